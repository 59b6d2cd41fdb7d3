"""Environments, closed when a test is over."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from factories.scenarios import smoke

from benchmark.learning.parallel import GoStopParallelEnv, parallel_env
from benchmark.learning.single import GoStopEnv


@pytest.fixture
def environment() -> Iterator[Callable[..., GoStopParallelEnv]]:
    made: list[GoStopParallelEnv] = []

    def make(**arguments: Any) -> GoStopParallelEnv:
        made.append(parallel_env(**{"scenario": smoke("crossing"), "rate": 0.7, **arguments}))
        return made[-1]

    yield make
    for one in made:
        one.close()


@pytest.fixture
def single() -> Iterator[Callable[..., GoStopEnv]]:
    made: list[GoStopEnv] = []

    def make(**arguments: Any) -> GoStopEnv:
        made.append(GoStopEnv(**{"scenario": smoke("crossing"), "rate": 0.7, **arguments}))
        return made[-1]

    yield make
    for one in made:
        one.close()

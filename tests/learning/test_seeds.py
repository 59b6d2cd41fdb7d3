"""Which traffic seeds environments play, and how those are declared."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmark.control.training import (
    FIRST_TRAINING_SEED,
    FRESH_SEEDS,
    UNUSED_SEEDS,
    VALIDATION_SEEDS,
    Training,
)
from benchmark.learning.parallel import GoStopParallelEnv
from benchmark.learning.seeds import TRAINING_SEEDS, declaration, joined, training_seed
from benchmark.learning.single import GoStopEnv
from benchmark.plumbing.errors import UsageError

SINGLE = "smoke/crossing"


@given(st.integers(0, FRESH_SEEDS.stop - 1))
def test_any_seed_leads_to_one_of_training_and_those_to_themselves(seed: int) -> None:
    played = training_seed(seed)
    assert played in TRAINING_SEEDS
    assert training_seed(played) == played
    assert (played == seed) is (seed in TRAINING_SEEDS)


def test_seeds_that_are_kept_for_something_lead_to_different_traffics() -> None:
    kept = range(1, FIRST_TRAINING_SEED)
    assert VALIDATION_SEEDS.start in kept
    assert UNUSED_SEEDS.start in kept
    assert [training_seed(seed) for seed in kept] == [seed + 10_000 for seed in kept]
    assert training_seed(FRESH_SEEDS.start) == 20_000


@pytest.mark.parametrize("kind", [GoStopEnv, GoStopParallelEnv])
@pytest.mark.parametrize("seed", [-1, 2**63, 1.0, "1", True, None])
def test_what_is_no_seed_is_refused(kind: Callable[..., object], seed: object) -> None:
    with pytest.raises(UsageError, match=r"seed .*: expected a whole number from 0 to"):
        kind(SINGLE, seed=seed)


def test_a_seed_that_a_library_gives_plays_traffic_of_training(
    single: Callable[..., GoStopEnv],
) -> None:
    env = single()
    seen, info = env.reset(seed=1)
    again, of_training = env.reset(seed=np.int64(10_001))  # type: ignore[arg-type]
    assert info["seed"] == 10_001
    assert info == of_training
    assert np.array_equal(seen, again)
    assert env.seeds_met == [10_001]
    _, info = env.reset(seed=3)
    assert info["seed"] == 10_003
    assert env.trained_on == (
        Training(scenarios=(env.scenario.name,), first=10_001, last=10_001),
        Training(scenarios=(env.scenario.name,), first=10_003, last=10_003),
    )
    assert env.trained_on[0].meets("smoke/crossing", 10_001)


def test_the_parallel_environment_maps_and_declares_seeds_too(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    env = environment()
    for seed in (1, None):
        _, infos = env.reset(seed=seed)
    assert {info["seed"] for info in infos.values()} == {10_002}
    assert env.trained_on == (Training(scenarios=(env.scenario.name,), first=10_001, last=10_002),)


@pytest.mark.parametrize("make", ["environment", "single"])
def test_whoever_asks_for_it_plays_seeds_as_they_are(
    make: str, request: pytest.FixtureRequest
) -> None:
    env: Any = request.getfixturevalue(make)(any_seed=True)
    env.reset(seed=1001)
    assert env.seeds_met == [1001]


def test_after_the_last_seed_of_training_comes_none_of_the_verifiers(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    env = environment(seed=TRAINING_SEEDS[-1])
    env.reset()
    env.reset()
    assert env.seeds_met == [20_000, TRAINING_SEEDS[-1]]


def test_declarations_of_several_environments_are_joined() -> None:
    one, other = declaration("a", [10_001, 10_002, 10_005]), declaration("a", [10_003])
    assert joined([one, other, declaration("b", [10_000]), declaration("b", [])]) == (
        Training(scenarios=("a",), first=10_001, last=10_003),
        Training(scenarios=("a",), first=10_005, last=10_005),
        Training(scenarios=("b",), first=10_000, last=10_000),
    )

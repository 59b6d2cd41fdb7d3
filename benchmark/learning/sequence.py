"""The traffics that an environment plays, one after another, at most one of them open."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypedDict, Unpack

import numpy as np

from benchmark.control.training import Training
from benchmark.learning.observation import Layout, size
from benchmark.learning.seeds import declaration, seed_from, training_seed
from benchmark.learning.traffic import Moment, Reward, Traffic
from benchmark.plumbing.errors import UsageError
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario

CHECKERS_OPTION = "options"  # PettingZoo's test resets with {"options": 1}


class Problem(TypedDict):
    """What else a learning problem consists of."""

    layout: Layout
    reward: Reward | None
    gridlock_after: float  # s


class TrafficSequence:
    """Traffics of one scenario, each with the seed after the last one's.

    Args:
        scenario: a scenario, or a reference to one, such as ``334`` or a file.
        rate: the penetration rate.
        seed: of the first traffic.
        any_seed: whether seeds are played as they are given; else each is one of training.
        problem: what ``Traffic`` is told.

    Raises:
        ScenarioError: the reference leads nowhere, or to several scenarios.
        UsageError: the seed is none, or the rate no share.
    """

    def __init__(
        self,
        scenario: Scenario | str,
        rate: float,
        seed: int,
        *,
        any_seed: bool,
        **problem: Unpack[Problem],
    ) -> None:
        self.scenario = catalogue.find_scenario(scenario) if isinstance(scenario, str) else scenario
        self.rate = _share(rate)
        self._any_seed, self._problem = any_seed, problem
        self.observation_size = size(problem["layout"])
        self.start_at(seed)
        self.seed: int | None = None  # of the traffic that is open, or was last
        self.seeds_met: list[int] = []  # ascending
        self.traffic: Traffic | None = None

    def start_at(self, seed: int) -> None:
        """Let the next traffic be that of a seed, or of the training seed in its place."""
        self._following = self._played(seed_from(seed))

    def _played(self, seed: int) -> int:
        return seed if self._any_seed else training_seed(seed)

    def prepare(self, seed: int | None, options: Mapping[str, Any] | None) -> None:
        """What ``reset`` was told; the open traffic ends where this concerns another one.

        Raises:
            UsageError: an option is unknown or makes no sense, or the seed is none.
        """
        told = dict(options or {})
        told.pop(CHECKERS_OPTION, None)
        rate = _share(told.pop("rate", self.rate))
        if told:
            raise UsageError(f'reset: unknown option "{next(iter(told))}"; expected "rate"')
        if seed is not None:
            self.start_at(seed)
        if seed is not None or rate != self.rate:
            self.close()
        self.rate = rate

    def open(self) -> Moment:
        """Begin the next traffic; its first moment."""
        self.close()
        seed = self._following
        traffic = Traffic(self.scenario, self.rate, seed, **self._problem)
        self.traffic, self.seed = traffic.__enter__(), seed
        self._following = self._played(seed + 1)
        self.seeds_met = sorted({*self.seeds_met, seed})
        return traffic.first()

    def step(self, actions: Mapping[str, int]) -> Moment:
        """Simulate a step of the open traffic."""
        assert self.traffic is not None
        return self.traffic.step(actions)

    @property
    def trained_on(self) -> tuple[Training, ...]:
        """The traffic met so far, as a controller declares it."""
        return declaration(self.scenario.name, self.seeds_met)

    @contextmanager
    def closed_on_failure(self) -> Iterator[None]:
        """Give the simulation up where what is done meanwhile fails."""
        try:
            yield
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the open traffic, if there is one."""
        traffic, self.traffic = self.traffic, None
        if traffic is not None:
            traffic.__exit__(None, None, None)


def _share(rate: object) -> float:
    said = repr(rate)
    if isinstance(rate, int | float | np.number):
        if 0 <= (share := float(rate)) <= 1:
            return share
        said = f"{share:g}"
    raise UsageError(f"rate {said}: expected a share from 0 to 1")

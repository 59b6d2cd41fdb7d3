"""Controllers of somebody who takes part."""

import time
from collections.abc import Mapping

from benchmark.control.controller import Command, Controller, Go, Stop
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState
from benchmark.control.training import Training
from benchmark.scenario.scenario import Scenario


class Entrant(Controller):
    """Lets RVs go that are slow enough.

    Args:
        slow: how slow that is [m/s].
    """

    trained_on = (Training(scenarios=("smoke",), first=10_000, last=10_009),)

    def __init__(self, slow: float = 5.0) -> None:
        self._slow = slow

    def reset(self, intersection: Intersection, seed: int) -> None:
        self._seed = seed

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {one.id: Go() if self._goes(one.speed) else Stop() for one in state.deciding}

    def _goes(self, speed: float) -> bool:
        return speed < self._slow


class Drawn(Entrant):
    """Decides by the clock, so that no episode comes out twice."""

    def _goes(self, speed: float) -> bool:
        return time.perf_counter_ns() % 2 == 0


class Fitted(Entrant):
    """Is good on the seeds that it was fitted to, and stops everybody on others."""

    trained_on = (Training(scenarios=("smoke/tee",), first=1, last=10),)

    def supports(self, scenario: Scenario) -> str | None:
        return None

    def _goes(self, speed: float) -> bool:
        return self._seed <= 10


class Secretive(Entrant):
    """Has weights and keeps to itself what they were trained on."""

    weights_hash = "0" * 64
    trained_on = None

"""The paper's hierarchy: Wang's Go or Stop, a learned low level under Stop, speed zones beneath."""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Literal

from baselines.hierarchical.hierarchy import Hierarchy, Low, Training
from baselines.hierarchical.observation import SIZE, LateralObserver
from baselines.hierarchical.policy import LowLevelObserver
from baselines.hierarchical.safety import with_braking
from baselines.wang.controller import Wang
from benchmark.control.arbitration import can_stop, held_by_conflict
from benchmark.control.controller import Command, Go
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle


class Hierarchical(Hierarchy):
    """The paper's hierarchy: Wang's Go/Stop, a learned low level under Stop, speed zones.

    A Go that the arbitration would hold back counts as Stop.

    Args:
        top: who says Go: Wang's policy, or everybody always.
        zones: whether the safety mechanism limits speeds.
        low: who drives under Stop: the learned policy, one that only drives on, or a random one.
        lateral: whether RVs change lanes.
        training: which shipped weights it follows; default: the median of three on validation.
        weights: other weights of the learned policy.
    """

    NAME = "hierarchical"
    SIZE = SIZE
    MEDIAN = 3

    def __init__(
        self,
        *,
        top: Literal["wang", "go"] = "wang",
        zones: bool = True,
        low: Low = "learned",
        lateral: bool = True,
        training: Training | None = None,
        weights: Path | None = None,
    ) -> None:
        super().__init__(low=low, lateral=lateral, training=training, weights=weights)
        self._wang = Wang() if top == "wang" else None
        self._zones = zones

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Look at another intersection."""
        super().reset(intersection, seed)
        if self._wang is not None:
            self._wang.reset(intersection, seed)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Go for RVs that may enter, Drive for the other RVs in the decision zone."""
        entering = self._entering(state)
        commands: dict[str, Command] = {
            ego.id: Go() for ego in state.deciding if ego.id in entering
        }
        stopped = [ego for ego in state.deciding if ego.id not in entering]
        return commands | self._drive(state, stopped)

    def _entering(self, state: TrafficState) -> Collection[str]:
        """RVs that the top level lets go and no conflict holds back, or that cannot stop."""
        movements = {ego.movement for ego in state.deciding}
        blocked = {name: held_by_conflict(state, name) for name in movements}
        free = [ego for ego in state.deciding if not (blocked[ego.movement] and can_stop(ego))]
        return self._wang.going(state, free) if self._wang else {ego.id for ego in free}

    def concerned(self, state: TrafficState) -> Iterable[Vehicle]:
        """The RVs in the decision zone."""
        return state.deciding

    def _observer(self) -> LowLevelObserver:
        return LateralObserver(self._intersection)

    def _limited(self, ego: Vehicle, acceleration: float) -> float:
        if not self._zones:
            return acceleration
        return with_braking(ego, acceleration, self._intersection.step)

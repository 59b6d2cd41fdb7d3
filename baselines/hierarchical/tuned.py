"""The hierarchy tuned: time windows on top, and a low level that sees the lanes around it."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from baselines.hierarchical.hierarchy import Hierarchy, Low, Training
from baselines.hierarchical.local_observation import SIZE, LocalObserver
from baselines.time_windows.controller import TimeWindows
from baselines.time_windows.queues import can_stop, to_the_line
from benchmark.control.controller import Command
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle

BRAKING = 1.0
"""With which refused RVs brake [m/s2]; waited less than ``time-windows`` on validation seeds."""


class HierarchicalTuned(Hierarchy):
    """The hierarchy with time windows on top and a local low level all over the control zone.

    Who may enter is decided as ``time-windows`` does; all other RVs of the control zone are driven
    by the low level, and those that were refused brake in time.

    Args:
        low: who drives under Stop: the learned policy, one that only drives on, or a random one.
        lateral: whether RVs change lanes.
        training: which shipped weights it follows; default: the median of three on validation.
        weights: other weights of the learned policy.
    """

    NAME = "hierarchical-tuned"
    SIZE = SIZE
    MEDIAN = 3
    arbitration = "own"

    def __init__(
        self,
        *,
        low: Low = "learned",
        lateral: bool = True,
        training: Training | None = None,
        weights: Path | None = None,
    ) -> None:
        super().__init__(low=low, lateral=lateral, training=training, weights=weights)
        self._windows = TimeWindows(braking=BRAKING)

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Look at another intersection and forget what flowed."""
        super().reset(intersection, seed)
        self._windows.reset(intersection, seed)
        self._refused = frozenset[str]()

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Drive for RVs that may not enter or are not asked yet; the others drive themselves."""
        decided = self._windows.decide(state)
        accepted = {vehicle.id for vehicle in decided.accepted}
        self._refused = frozenset(vehicle.id for vehicle in decided.refused)
        self._local.look(decided.queues, self._refused)
        step = self._intersection.step
        egos = [
            vehicle
            for queue in decided.queues
            for vehicle in queue.vehicles
            if vehicle.is_robot and vehicle.id not in accepted and can_stop(vehicle, step)
        ]
        return self._drive(state, egos)

    def concerned(self, state: TrafficState) -> Iterable[Vehicle]:
        """All RVs in the control zone."""
        return (vehicle for vehicle in state.vehicles if vehicle.is_robot)

    def _observer(self) -> LocalObserver:
        self._local = LocalObserver(self._intersection)
        return self._local

    def _limited(self, ego: Vehicle, acceleration: float) -> float:
        if ego.id not in self._refused:
            return acceleration
        return min(acceleration, to_the_line(ego, self._windows.braking, self._intersection.step))

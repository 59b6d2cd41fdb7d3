"""What the low level observes: Wang's numbers and whether the lanes beside are led by an RV."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle
from benchmark.learning.observation import Numbers, Observer, size

SIZE = size("paper") + 2
Side = Literal[-1, 0, 1]

SIDES: tuple[Side, Side] = (1, -1)  # left, right: what is added to the index of a lane


def beside(intersection: Intersection) -> dict[str, tuple[str | None, str | None]]:
    """The lanes to the left and to the right of each lane; None where there is none."""
    lanes = {(lane.approach, lane.index): lane.id for lane in intersection.lanes.values()}
    return {
        lane.id: (
            lanes.get((lane.approach, lane.index + SIDES[0])),
            lanes.get((lane.approach, lane.index + SIDES[1])),
        )
        for lane in intersection.lanes.values()
    }


class LateralObserver:
    """Turns traffic into the low level's observations (paper, "Low-level ... Control").

    Args:
        intersection: where.
    """

    def __init__(self, intersection: Intersection) -> None:
        self._macroscopic = Observer(intersection, "paper")
        self._beside = beside(intersection)

    def observe(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """What each ego observes.

        Args:
            state: the traffic now.
            egos: vehicles in the decision zone with a regulated movement.

        Returns:
            Shape (egos, ``SIZE``): the paper's 97 numbers of the high level, whose last is the
            distance, then 1 where an RV is on the lane to the left, and to the right.
        """
        rows = np.zeros((len(egos), SIZE), dtype=np.float32)
        rows[:, :-2] = self._macroscopic.observe(state, egos)
        led = {vehicle.lane for vehicle in state.vehicles if vehicle.is_robot}
        for row, ego in zip(rows, egos, strict=True):
            row[-2:] = [lane in led for lane in self._beside.get(ego.lane, (None, None))]
        return rows

"""What an RV that decides Go or Stop observes, as numbers; one code for training and evaluation.

The paper's layout (section "High-level Control Decisions") has 97 numbers; the extended one adds
to them. docs/learning.md holds the table.
"""

from collections.abc import Sequence
from functools import cache
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from benchmark.control.arbitration import held_by_conflict
from benchmark.control.intersection import Intersection
from benchmark.control.state import CELLS, STATIONARY, TrafficState, Vehicle
from benchmark.plumbing.errors import UsageError

Layout = Literal["paper", "extended"]
Numbers = npt.NDArray[np.float32]

MOVEMENTS = tuple(f"{approach}-{turn}" for approach in "NESW" for turn in "LC")
"""The eight movements that can conflict, clockwise; a missing leg's are observed as zeros."""

LONGEST_WAIT = 200.0  # s, observed as 1 (Wang et al.)
MANY = 40.0  # vehicles of one movement in the control zone, observed as 1
FEW = 4.0  # vehicles that stand inside, observed as 1
FAST = 20.0  # m/s, observed as 1

_J = len(MOVEMENTS)
_PAPER = {"queue": 1, "waiting": 1, "occupancy": CELLS}  # numbers for each movement
_EXTENDED = {"vehicles": 1, "robots": 1, "standing inside": 1}
_EGO = 5  # further numbers on the ego in the extended layout


def size(layout: Layout) -> int:
    """How many numbers a layout has.

    Raises:
        UsageError: there is no such layout.
    """
    if layout not in (known := get_args(Layout)):
        raise UsageError(f'unknown layout "{layout}"; expected one of {", ".join(known)}')
    paper = sum(_PAPER.values()) * _J + 1
    return paper if layout == "paper" else paper + sum(_EXTENDED.values()) * _J + _EGO


class Observer:
    """Turns the traffic of one intersection into observations.

    Args:
        intersection: where.
        layout: ``paper`` or ``extended``.
    """

    def __init__(self, intersection: Intersection, layout: Layout) -> None:
        self._layout, self._zone = layout, intersection.decision_zone
        self._present = [
            (index, name) for index, name in enumerate(MOVEMENTS) if name in intersection.movements
        ]

    def observe(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """What each ego observes, in its own point of view.

        Args:
            state: the traffic now.
            egos: vehicles in the decision zone with a regulated movement, as in
                ``TrafficState.deciding``.

        Returns:
            Shape (egos, ``size(layout)``), every number in [0, 1]: queue lengths of the eight
            movements, their mean waiting, ten occupancy cells of each, the ego's distance, and
            what the extended layout adds. The ego's own movement comes first, the others follow
            clockwise, modulo eight.
        """
        found = np.zeros((len(egos), size(self._layout)), dtype=np.float32)
        if not egos:
            return found
        views = _views(self._layout)
        traffic = self._paper(state)
        if self._layout == "extended":
            traffic = np.concatenate([traffic, self._extended(state)])
            blocked = {name: held_by_conflict(state, name) for name in {e.movement for e in egos}}
            found[:, -_EGO:] = [_on_ego(ego, blocked[ego.movement]) for ego in egos]
        paper = sum(_PAPER.values()) * _J
        seen = traffic[[views[seen_as(ego.movement)] for ego in egos]]
        found[:, :paper] = seen[:, :paper]
        found[:, paper] = [ego.distance / self._zone for ego in egos]
        found[:, paper + 1 : seen.shape[1] + 1] = seen[:, paper:]
        return np.clip(found, 0.0, 1.0, out=found)

    def _paper(self, state: TrafficState) -> Numbers:
        """Queue lengths, waiting and occupancy, movements clockwise from ``MOVEMENTS[0]``."""
        found = np.zeros((2 + CELLS) * _J, dtype=np.float32)
        occupancy = found[2 * _J :].reshape(_J, CELLS)
        for index, name in self._present:
            movement = state.movements[name]
            found[index] = movement.queue_length
            found[_J + index] = movement.waiting / LONGEST_WAIT
            if any(movement.occupancy):
                occupancy[index] = movement.occupancy
        found[:_J] /= max(1.0, float(found[:_J].max()))  # the longest queue is observed as 1
        return found

    def _extended(self, state: TrafficState) -> Numbers:
        """Load, RVs among it and vehicles that stand inside, by movement."""
        found = np.zeros((len(_EXTENDED), _J), dtype=np.float32)
        for index, name in self._present:
            movement = state.movements[name]
            found[0, index] = movement.vehicles / MANY
            found[1, index] = movement.robots / MANY
        places = {name: index for index, name in self._present}
        for crossing in state.inside:
            if crossing.speed < STATIONARY and crossing.movement in places:
                found[2, places[crossing.movement]] += 1 / FEW
        return found.ravel()


def seen_as(movement: str) -> str:
    """The one of the paper's eight movements whose view an ego has; U-turns have the left's."""
    return f"{movement[:-1]}L" if movement.endswith("U") else movement


def _on_ego(ego: Vehicle, blocked: bool) -> tuple[float, ...]:
    left = ego.movement.endswith("L")
    return left, ego.speed / FAST, ego.waiting / LONGEST_WAIT, ego.held_back, blocked


@cache
def _views(layout: Layout) -> dict[str, npt.NDArray[np.intp]]:
    """For each movement the order in which an ego that makes it sees the traffic's numbers."""
    widths = [*_PAPER.values(), *(_EXTENDED.values() if layout == "extended" else ())]
    views = {}
    for own, movement in enumerate(MOVEMENTS):
        order: list[int] = []
        start = 0
        for width in widths:
            for step in range(_J):
                first = start + width * ((own + step) % _J)
                order.extend(range(first, first + width))
            start += width * _J
        views[movement] = np.asarray(order, dtype=np.intp)
    return views

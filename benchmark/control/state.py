"""What a controller sees: the traffic at one intersection at one moment. Read-only."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

from benchmark.control.intersection import Intersection

CELLS = 10
"""Cells of equal length into which each way through is divided (paper: occupancy map)."""

EMPTY = (False,) * CELLS

STATIONARY = 0.1  # m/s; slower than this a vehicle stands


class Body(NamedTuple):
    """What a vehicle's class can do."""

    vehicle_class: str
    length: float  # m
    acceleration: float  # m/s2, greatest
    deceleration: float  # m/s2, greatest in service; positive
    maximum_speed: float  # m/s, or the scenario's cap where that is lower


class Vehicle(NamedTuple):
    """A vehicle in the control zone."""

    id: str
    is_robot: bool  # whether it is an RV
    movement: str  # id of the movement it will make, as in "E-L"
    lane: str  # id; one of Intersection.lanes, or a lane further upstream
    distance: float  # m to the entrance
    speed: float  # m/s
    waiting: float  # s stationary in the control zone since it entered it
    held_back: bool  # whether its Go of the last step was held back by the arbitration
    body: Body


class Crossing(NamedTuple):
    """A vehicle inside the intersection."""

    id: str
    is_robot: bool
    movement: str
    lane: str  # id of the incoming lane that its way continues
    position: float  # m behind the entrance, along its way
    way_length: float  # m
    speed: float  # m/s
    body: Body

    @property
    def cell(self) -> int:
        """The cell of its way that its front is in, 0 at the entrance to 9 at the exit."""
        return min(int(CELLS * self.position / self.way_length), CELLS - 1)


class MovementState(NamedTuple):
    """The traffic of one movement."""

    vehicles: int  # in the control zone
    robots: int  # RVs among them
    queue_length: int  # vehicles that stand in the control zone
    waiting: float  # s, mean over its vehicles in the control zone; 0 without any
    occupancy: tuple[bool, ...]  # CELLS cells from entrance to exit: whether a vehicle is in it

    def pressure(self, waiting_weight: float) -> float:
        """How much it wants to go: its vehicles, each worth more the longer they wait.

        Args:
            waiting_weight: how many vehicles a second of mean waiting is worth to each [1/s].
        """
        return self.vehicles * (1 + waiting_weight * self.waiting)


@dataclass(frozen=True)
class TrafficState:
    """One intersection at one moment; everything the papers observe."""

    intersection: Intersection
    time: float  # s since the episode began
    vehicles: tuple[Vehicle, ...]  # in the control zone
    inside: tuple[Crossing, ...]  # inside the intersection
    phase: str | None = None  # the signal phase that shows green, where the controller sets phases

    @cached_property
    def deciding(self) -> tuple[Vehicle, ...]:
        """The RVs in the decision zone whose movement is regulated: those that Go and Stop."""
        regulated = frozenset(self.intersection.regulated_movements)
        reach = self.intersection.decision_zone
        return tuple(
            vehicle
            for vehicle in self.vehicles
            if vehicle.is_robot and vehicle.distance <= reach and vehicle.movement in regulated
        )

    @cached_property
    def movements(self) -> Mapping[str, MovementState]:
        """The state of every movement, right turns included."""
        sums = {name: [0, 0, 0, 0.0] for name in self.intersection.movements}
        for vehicle in self.vehicles:
            total = sums[vehicle.movement]
            total[0] += 1
            total[1] += vehicle.is_robot
            total[2] += vehicle.speed < STATIONARY
            total[3] += vehicle.waiting
        cells: dict[str, set[int]] = {}
        for crossing in self.inside:
            cells.setdefault(crossing.movement, set()).add(crossing.cell)
        return MappingProxyType(
            {
                name: MovementState(
                    vehicles=int(count),
                    robots=int(robots),
                    queue_length=int(standing),
                    waiting=waiting / max(1, count),
                    occupancy=_occupancy(cells[name]) if name in cells else EMPTY,
                )
                for name, (count, robots, standing, waiting) in sums.items()
            }
        )

    @cached_property
    def longest_waiting(self) -> str | None:
        """The regulated movement with the longest mean waiting, or None while nobody waits."""
        waiting = {
            name: self.movements[name].waiting for name in self.intersection.regulated_movements
        }
        longest = max(waiting, key=waiting.__getitem__, default=None)
        return longest if longest is not None and waiting[longest] > 0 else None

    @cached_property
    def unregulated_lanes(self) -> tuple[str, ...]:
        """Ids of the left and cross lanes of the control zone with no RV on them."""
        led = {vehicle.lane for vehicle in self.vehicles if vehicle.is_robot}
        return tuple(lane for lane in self.intersection.regulated_lanes if lane not in led)


def _occupancy(cells: set[int]) -> tuple[bool, ...]:
    return tuple(cell in cells for cell in range(CELLS))

"""What an intersection is: lanes, movements, their ways through and what conflicts with what.

Plain facts without SUMO, read from the network by ``benchmark.sumo.network`` and handed to every
controller when an episode begins.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

Point = tuple[float, float]

DrivingSide = Literal["right", "left"]
"""Where traffic drives."""


@dataclass(frozen=True, slots=True)
class Lane:
    """An incoming lane that ends at the entrance."""

    id: str
    approach: str
    index: int  # 0 at the kerb
    movements: tuple[str, ...]  # ids of the movements it serves
    length: float  # m
    width: float  # m
    speed_limit: float  # m/s
    shape: tuple[Point, ...]  # m, centre line in driving direction


@dataclass(frozen=True, slots=True)
class Way:
    """The way of one incoming lane through the intersection."""

    lane: str  # id of the incoming lane
    exit_lane: str
    length: float  # m, from the entrance to the exit
    speed_limit: float  # m/s, of its slowest piece
    shape: tuple[Point, ...]  # m, centre line in driving direction


@dataclass(frozen=True, slots=True)
class Movement:
    """An approach and a turn, as in ``E-L``: eastbound left."""

    id: str
    approach: str
    turn: str  # "L", "C", "R" or "U"
    exit: str  # id of the road it leaves on
    ways: tuple[Way, ...]
    conflicts: frozenset[str]  # ids of the movements that cross or merge with it
    kerb_turn: str = "R"  # the turn that keeps to the kerb; "L" where traffic drives on the left

    @property
    def lanes(self) -> tuple[str, ...]:
        """Ids of the incoming lanes that serve it."""
        return tuple(way.lane for way in self.ways)

    @property
    def regulated(self) -> bool:
        """Whether it is one of the movements that Go and Stop regulate.

        Turns to the kerb stay out of it (paper, Intersectional Traffic Flow). The paper has no
        U-turns, which cross as lefts do.
        """
        return not self.keeps_to_kerb

    @property
    def keeps_to_kerb(self) -> bool:
        """Whether it turns without crossing anybody: right where traffic drives on the right."""
        return self.turn == self.kerb_turn

    @property
    def crosses_oncoming(self) -> bool:
        """Whether it turns across oncoming traffic: left where traffic drives on the right."""
        return self.turn in "LR" and not self.keeps_to_kerb


@dataclass(frozen=True)
class Intersection:
    """The facts of one intersection; the same for every controller, rate and seed."""

    id: str
    control_zone: float  # m
    decision_zone: float  # m
    step: float  # s of simulated time between two calls of ``act``
    lanes: Mapping[str, Lane]
    movements: Mapping[str, Movement]
    phases: Mapping[str, frozenset[str]]  # name of a signal phase -> its movements
    driving_side: DrivingSide = "right"

    @cached_property
    def approaches(self) -> tuple[str, ...]:
        """Ids of the roads that lead here, clockwise."""
        return tuple(dict.fromkeys(lane.approach for lane in self.lanes.values()))

    @property
    def turns_abreast(self) -> str:
        """The turns as their lanes lie, from the driver's left to the right."""
        return "ULCR" if self.driving_side == "right" else "LCRU"

    @cached_property
    def regulated_movements(self) -> tuple[str, ...]:
        """Ids of the regulated movements, clockwise by approach; eight on four legs."""
        return tuple(name for name, movement in self.movements.items() if movement.regulated)

    @cached_property
    def regulated_lanes(self) -> tuple[str, ...]:
        """Ids of the incoming lanes that serve a regulated movement."""
        return tuple(
            lane.id
            for lane in self.lanes.values()
            if any(self.movements[movement].regulated for movement in lane.movements)
        )

    def conflict(self, movement: str, other: str) -> bool:
        """Whether two regulated movements may not use the intersection together."""
        return other in self.movements[movement].conflicts

    @cached_property
    def conflict_free_sets(self) -> tuple[frozenset[str], ...]:
        """The largest sets of regulated movements that may go together (the paper's set C)."""
        sets: list[frozenset[str]] = []

        def grow(chosen: frozenset[str], candidates: tuple[str, ...]) -> None:
            if not candidates and not any(chosen < other for other in sets):
                sets.append(chosen)
            for index, movement in enumerate(candidates):
                rest = candidates[index + 1 :]
                free = tuple(other for other in rest if not self.conflict(movement, other))
                grow(chosen | {movement}, free)

        grow(frozenset(), self.regulated_movements)
        return tuple(free for free in sets if not any(free < other for other in sets))

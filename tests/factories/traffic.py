"""An intersection and its traffic by hand: no SUMO, no file."""

import math
from collections.abc import Collection
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from benchmark.control.intersection import Intersection, Lane, Movement, Way
from benchmark.control.state import Body, Crossing, TrafficState, Vehicle
from benchmark.scenario.layout import LETTERS

CONFLICT_FREE = frozenset(
    frozenset(pair.split())
    for pair in (
        *("S-C N-C", "W-C E-C", "S-L N-L", "E-L W-L"),
        *("S-C S-L", "E-C E-L", "N-C N-L", "W-C W-L"),
    )
)  # the paper's set, section Intersectional Traffic Flow

WAY_LENGTH = 20.0  # m
CAR = Body("car", length=5.0, acceleration=2.6, deceleration=4.5, maximum_speed=15.0)


def crossroads(conflicts: Collection[frozenset[str]] | None = None, **facts: Any) -> Intersection:
    """Four approaches with the lanes R C C L each, and the paper's conflicts unless given."""
    regulated = [f"{letter}-{turn}" for letter in LETTERS.values() for turn in "LC"]
    pairs = {frozenset(pair) for pair in combinations(regulated, 2)}
    conflicts = pairs - CONFLICT_FREE if conflicts is None else conflicts
    lanes, movements = {}, {}
    for approach, letter in LETTERS.items():
        for turn, indices in (("L", (3,)), ("C", (1, 2)), ("R", (0,))):
            name = f"{letter}-{turn}"
            ways = tuple(
                Way(f"{approach}_{i}", f"exit.{letter}{turn}_{i}", WAY_LENGTH, 13.89, ())
                for i in indices
            )
            others = frozenset().union(*(pair for pair in conflicts if name in pair)) - {name}
            movements[name] = Movement(name, approach, turn, f"exit.{letter}{turn}", ways, others)
        for index, turn in enumerate("RCCL"):
            lane = f"{approach}_{index}"
            serves = (f"{letter}-{turn}",)
            lanes[lane] = Lane(lane, approach, index, serves, 60.0, 3.2, 13.89, ())
    settled = {"control_zone": 100.0, "decision_zone": 30.0, "step": 1.0, "phases": {}, **facts}
    return Intersection(id="intersection", lanes=lanes, movements=movements, **settled)


CROSSROADS = crossroads()


def vehicle(name: str = "rv", movement: str = "N-C", **facts: Any) -> Vehicle:
    """An RV on the first lane of its movement, 20 m before the entrance at 5 m/s."""
    lane = CROSSROADS.movements[movement].lanes[0]
    settled = {"is_robot": True, "lane": lane, "distance": 20.0, "speed": 5.0, "waiting": 0.0}
    return Vehicle(
        id=name, movement=movement, **{**settled, "held_back": False, "body": CAR, **facts}
    )


def crossing(movement: str = "E-C", cell: int = 0, name: str = "crossing") -> Crossing:
    """An HV in the middle of a cell of its way through the intersection."""
    lane = CROSSROADS.movements[movement].lanes[0]
    position = (cell + 0.5) * WAY_LENGTH / 10
    return Crossing(name, False, movement, lane, position, WAY_LENGTH, 5.0, CAR)


def state(*who: Vehicle | Crossing, time: float = 0.0, where: Intersection = CROSSROADS) -> Any:
    """The traffic of these vehicles."""
    return TrafficState(
        where,
        time,
        tuple(one for one in who if isinstance(one, Vehicle)),
        tuple(one for one in who if isinstance(one, Crossing)),
    )


HALF = 14.0  # m, half the width of the box
TURNS = {"N": 0, "W": 1, "S": 2, "E": 3}  # quarter turns counterclockwise from northbound


def _shape(letter: str, index: int, turn: str) -> tuple[tuple[float, float], ...]:
    """A straight way or a quarter circle; lane 3 is the innermost of four."""
    x = 1.6 + 3.2 * (3 - index)
    if turn == "C":
        points = [(x, -HALF), (x, HALF)]
    else:
        centre, side = (-HALF, 1) if turn == "L" else (HALF, -1)
        radius = abs(x - centre)
        angles = np.linspace(0, math.pi / 2, 25)
        points = [
            (centre + side * radius * math.cos(a), -HALF + radius * math.sin(a)) for a in angles
        ]
    for _ in range(TURNS[letter]):
        points = [(-y, x) for x, y in points]
    return tuple(points)


def drawn() -> Intersection:
    """The crossroads with ways that have shapes."""
    movements = {}
    for name, movement in CROSSROADS.movements.items():
        ways = []
        for way in movement.ways:
            shape = _shape(name[0], int(way.lane[-1]), movement.turn)
            length = float(np.hypot(*np.diff(np.array(shape), axis=0).T).sum())
            ways.append(replace(way, shape=shape, length=length))
        movements[name] = replace(movement, ways=tuple(ways))
    return replace(CROSSROADS, movements=movements)

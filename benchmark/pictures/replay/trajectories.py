"""What an episode looked like from above: where every vehicle was at every step, and why.

Plain data without SUMO: ``recorder.py`` makes it, ``document.py`` packs it, ``page`` and ``film``
show it. Places are in metres of the network, x to the east and y to the north.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from benchmark.records.record import Record

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

Place = tuple[float, float]
Outline = list[Place]


class Told(IntEnum):
    """What an RV was told for the next step, refused commands left out."""

    NOTHING = 0
    GO = 1
    STOP = 2
    HELD = 3  # a Go that the arbitration held back
    DRIVE = 4


class StopLine(Struct, frozen=True):
    """The bar across an incoming lane."""

    ends: tuple[Place, Place]
    yields: bool  # from a slip lane one yields instead


class RegulatedLane(Struct, frozen=True):
    """An incoming lane that serves a left or cross movement."""

    lane: str
    outline: Outline  # of its part in the control zone


class Head(Struct, frozen=True):
    """The signal head of one link at the entrance."""

    link: int  # its place in the light's state
    place: Place
    angle: float  # of driving direction, degrees clockwise from north
    width: float  # m that it may take


class MovementName(Struct, frozen=True):
    """A movement, as in ``E-L``."""

    id: str
    approach: str
    turn: str


class JunctionGround(Struct, frozen=True):
    """The parts of the ground that belong to one junction."""

    id: str
    centre: Place
    radius: float  # m from the centre to the farthest side of the box around its entrances
    movements: list[MovementName]
    regulated_lanes: list[RegulatedLane]
    heads: list[Head]


class Ground(Struct, frozen=True):
    """Everything that does not move."""

    asphalt: list[Outline]
    lane_lines: list[Outline]
    centre_lines: list[Outline]
    arrows: list[Outline]
    stop_lines: list[StopLine]
    control_zone: list[Outline]
    decision_zone: list[Outline]
    junctions: list[JunctionGround]


class Silhouette(Struct, frozen=True):
    """The size of a class of vehicles."""

    name: str
    length: float  # m
    width: float  # m


class Collision(Struct, frozen=True):
    """Two vehicles that touched."""

    first: int  # step
    last: int  # step
    vehicles: tuple[int, int]  # indices
    counted: bool  # whether the record counts it: it lasted into the evaluation window


class Vehicles(Struct, frozen=True):
    """What stays the same of each vehicle; the lists have an entry per vehicle."""

    id: list[str]
    kind: list[int]  # index of its class
    robot: list[bool]
    movement: list[str]
    first: list[int]  # the step in which it appears
    steps: list[int]  # in how many steps it is there, one after another


@dataclass(frozen=True)
class Tracks:
    """Where vehicles were: arrays with an entry per vehicle and step, one vehicle after another."""

    x: Floats  # m, of the middle of the front bumper
    y: Floats  # m
    angle: Floats  # degrees clockwise from north, without jumps at 360
    speed: Floats  # m/s
    told: Ints  # Told
    acceleration: Floats  # m/s2, of a Drive
    side: Ints  # lane change of a Drive, as drivers see it: 1 to the left, -1 to the right
    in_zone: Ints  # 1 in the control zone, 0 elsewhere
    waited: Ints  # steps it stood in control zones so far


@dataclass(frozen=True)
class Curves:
    """The figures of one junction over time, by the benchmark's own tracking.

    Arrays have an entry per step; nan stands where no vehicle is there to be averaged.
    """

    average: Floats  # s, ``average_waiting_time`` of the window so far
    waiting: Floats  # s, mean ``w_v(t)`` over the vehicles in the control zone
    movement_waiting: Floats  # s, the same per movement, shape (movements, steps)
    movement_vehicles: Ints  # vehicles in the control zone, shape (movements, steps)
    passed: Ints  # vehicles past the entrance in the window so far
    unregulated: Ints  # 1 where a regulated lane has no RV, shape (regulated lanes, steps)
    states: list[str]  # of the lights, those that occur; empty where they are dark
    light: Ints  # index of the state that shows


@dataclass(frozen=True)
class Trajectories:
    """One recorded episode."""

    title: str  # of the scenario
    record: Record
    step: float  # s of simulated time
    start: float  # s, the time of the first step
    steps: int
    warm_up: float  # s; what comes after it counts
    ground: Ground
    classes: list[Silhouette]
    vehicles: Vehicles
    tracks: Tracks
    curves: list[Curves]  # one per junction of the ground
    collisions: list[Collision]

    @property
    def offsets(self) -> Ints:
        """Where each vehicle's entries begin in ``tracks``, and the end of the last's."""
        return np.concatenate([[0], np.cumsum(self.vehicles.steps, dtype=np.int64)])

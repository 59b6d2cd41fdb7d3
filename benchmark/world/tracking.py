"""Follows the vehicles of one intersection: who is where, and how long each has stood.

The tracker turns SUMO's readings into what controllers see, and writes the log that the metrics
are computed from.
"""

from array import array
from collections.abc import Callable
from dataclasses import dataclass, field

from benchmark.control.state import STATIONARY, Body, Crossing, Vehicle
from benchmark.sumo.junction import Junction
from benchmark.sumo.simulation import Reading


@dataclass(frozen=True, slots=True)
class Identity:
    """What stays the same of a vehicle through an episode."""

    id: str
    is_robot: bool
    movement: str
    body: Body


@dataclass
class Log:
    """What happened in one control zone, in columns that take little memory in a long episode.

    ``times`` and ``present`` have an entry per step; ``vehicle``, ``lane`` and ``waiting`` one per
    vehicle and step, the steps one after another.
    """

    lanes: tuple[str, ...]  # the zone's; ``lane`` holds indices into it
    vehicles: list[Identity] = field(default_factory=list)  # ``vehicle`` holds indices into it
    times: "array[float]" = field(default_factory=lambda: array("d"))  # s
    present: "array[int]" = field(default_factory=lambda: array("l"))  # vehicles in the zone
    vehicle: "array[int]" = field(default_factory=lambda: array("l"))
    lane: "array[int]" = field(default_factory=lambda: array("l"))
    waiting: "array[float]" = field(default_factory=lambda: array("d"))  # w_v(t), s


class Tracker:
    """Follows one junction through one episode.

    Args:
        junction: where.
        identify: a vehicle's unchanging facts, asked once per vehicle.
    """

    def __init__(self, junction: Junction, identify: Callable[[str], Identity]) -> None:
        self.log = Log(tuple(junction.zone))
        self._junction, self._identify = junction, identify
        self._step = junction.intersection.step
        self._lane_index = {lane: index for index, lane in enumerate(self.log.lanes)}
        self._index: dict[str, int] = {}  # of a vehicle in the log
        self._waiting: list[float] = []  # by the same index, s

    def update(
        self,
        time: float,
        zone: list[Reading],
        inside: list[Reading],
        held_back: frozenset[str],
    ) -> tuple[tuple[Vehicle, ...], tuple[Crossing, ...]]:
        """Take the readings of one step.

        Args:
            time: now [s].
            zone: vehicles in the control zone, with their distance to the entrance.
            inside: vehicles inside the junction, with their position on their lane.
            held_back: RVs whose Go of the last step was held back.

        Returns:
            The vehicles in the control zone and those inside the intersection.
        """
        vehicles = self._vehicles(zone, held_back)
        self.log.times.append(time)
        self.log.present.append(len(vehicles))
        return vehicles, tuple(self._crossing(*reading) for reading in inside)

    def _known(self, name: str) -> int:
        if (index := self._index.get(name)) is None:
            index = self._index[name] = len(self._index)
            self.log.vehicles.append(self._identify(name))
            self._waiting.append(0.0)
        return index

    def _vehicles(self, zone: list[Reading], held_back: frozenset[str]) -> tuple[Vehicle, ...]:
        """The control zone's vehicles; these lines run fifty thousand times an episode."""
        log, waiting, known, lanes = self.log, self._waiting, self._index, self._lane_index
        indices = [known[name] if name in known else self._known(name) for name, *_ in zone]
        for index, reading in zip(indices, zone, strict=True):
            if reading[3] < STATIONARY:
                waiting[index] += self._step
        stood = [waiting[index] for index in indices]
        log.vehicle.extend(indices)
        log.lane.extend([lanes[lane] for _, lane, _, _ in zone])
        log.waiting.extend(stood)
        make, back = (
            tuple.__new__,
            held_back.__contains__,
        )  # make(Vehicle, ...): a fast Vehicle(...)
        return tuple(
            [
                make(Vehicle, (n, who.is_robot, who.movement, lane, d, v, w, back(n), who.body))
                for (n, lane, d, v), w, who in zip(
                    zone, stood, map(log.vehicles.__getitem__, indices), strict=True
                )
            ]
        )

    def _crossing(self, name: str, lane: str, position: float, speed: float) -> Crossing:
        place, who = self._junction.inside[lane], self.log.vehicles[self._known(name)]
        return Crossing(
            id=who.id,
            is_robot=who.is_robot,
            movement=place.movement,
            lane=place.lane,
            position=place.offset + position,
            way_length=place.length,
            speed=speed,
            body=who.body,
        )

"""Follows the vehicles of one intersection: who is where, and how long each has stood.

The tracker turns SUMO's readings into what controllers see, and writes the log that the metrics
are computed from.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from benchmark.network import Junction
from benchmark.simulation import InJunction, InZone
from benchmark.state import STATIONARY, Body, Crossing, Vehicle


@dataclass
class Log:
    """What happened in one control zone, in columns.

    ``step``, ``vehicle``, ``movement`` and ``waiting`` have an entry per vehicle and step; the
    other columns one per step.
    """

    times: list[float] = field(default_factory=list)  # s
    unregulated: list[float] = field(default_factory=list)  # share of lanes
    crossed: list[int] = field(default_factory=list)  # vehicles that passed the entrance
    lane_changes: list[int] = field(default_factory=list)
    step: list[int] = field(default_factory=list)
    vehicle: list[str] = field(default_factory=list)
    movement: list[str] = field(default_factory=list)
    waiting: list[float] = field(default_factory=list)  # w_v(t), s


@dataclass(frozen=True, slots=True)
class Identity:
    """What stays the same of a vehicle through an episode."""

    is_robot: bool
    movement: str
    body: Body


class Tracker:
    """Follows one junction through one episode.

    Args:
        junction: where.
        step: simulated time per step [s].
        identify: a vehicle's unchanging facts, asked once per vehicle.
    """

    def __init__(
        self, junction: Junction, step: float, identify: Callable[[str], Identity]
    ) -> None:
        self.log = Log()
        self._junction, self._step, self._identify = junction, step, identify
        self._identities: dict[str, Identity] = {}
        self._waiting: dict[str, float] = {}
        self._lanes: dict[str, str] = {}

    def update(
        self, time: float, zone: list[InZone], inside: list[InJunction], held_back: frozenset[str]
    ) -> tuple[tuple[Vehicle, ...], tuple[Crossing, ...]]:
        """Take the readings of one step.

        Returns:
            The vehicles in the control zone and those inside the intersection.
        """
        vehicles = self._vehicles(zone, held_back)
        self._write(time, vehicles)
        places = self._junction.inside
        crossings = []
        for name, lane, position, speed in inside:
            place, who = places[lane], self._identity(name)
            crossings.append(
                Crossing(
                    *(name, who.is_robot, place.movement, place.lane),
                    *(place.offset + position, place.length, speed, who.body),
                )
            )
        return vehicles, tuple(crossings)

    def _identity(self, name: str) -> Identity:
        if (known := self._identities.get(name)) is None:
            known = self._identities[name] = self._identify(name)
        return known

    def _vehicles(self, zone: list[InZone], held_back: frozenset[str]) -> tuple[Vehicle, ...]:
        waiting, step, identities = self._waiting, self._step, self._identities
        found = []
        for name, lane, distance, speed in zone:
            stood = waiting.get(name, 0.0)
            if speed < STATIONARY:
                stood += step
            waiting[name] = stood
            who = identities.get(name) or self._identity(name)
            found.append(
                Vehicle(
                    *(name, who.is_robot, who.movement, lane, distance, speed, stood),
                    *(name in held_back, who.body),
                )
            )
        return tuple(found)

    def _write(self, time: float, vehicles: tuple[Vehicle, ...]) -> None:
        log, before = self.log, self._lanes
        now = {vehicle.id: vehicle.lane for vehicle in vehicles}
        log.times.append(time)
        log.step.extend([len(log.times) - 1] * len(vehicles))
        log.vehicle.extend(now)
        log.movement.extend([vehicle.movement for vehicle in vehicles])
        log.waiting.extend([vehicle.waiting for vehicle in vehicles])
        log.crossed.append(len(before.keys() - now.keys()))
        log.lane_changes.append(
            sum(
                1
                for name, lane in now.items()
                if before.get(name, lane) != lane and self._beside(before[name], lane)
            )
        )
        led = {vehicle.lane for vehicle in vehicles if vehicle.is_robot}
        lanes = self._junction.intersection.regulated_lanes
        log.unregulated.append(sum(lane not in led for lane in lanes) / len(lanes))
        self._lanes = now

    def _beside(self, one: str, other: str) -> bool:
        """Whether two lanes of the zone lie beside each other, so that moving over is a change."""
        a, b = self._junction.zone[one], self._junction.zone[other]
        return a.end == b.end and a.approach == b.approach

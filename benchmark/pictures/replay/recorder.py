"""Watches a world and keeps where everybody was: the onlooker behind replays.

A world without a recorder does nothing for it.
"""

from array import array
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from benchmark.control.controller import Command, Drive, Go, Stop
from benchmark.pictures.replay.curves import curves_of
from benchmark.pictures.replay.ground import ground_of
from benchmark.pictures.replay.trajectories import (
    Collision,
    Floats,
    Ints,
    Silhouette,
    Told,
    Tracks,
    Trajectories,
    Vehicles,
)
from benchmark.records.record import Record
from benchmark.scenario.scenario import Scenario
from benchmark.sumo.network import Network
from benchmark.sumo.simulation import Pose
from benchmark.world import metrics
from benchmark.world.onlooker import Newcomer
from benchmark.world.rules import Orders
from benchmark.world.scoring import Sights
from benchmark.world.tracking import Log


class Recorder:
    """Keeps one episode: an ``Onlooker`` of a world."""

    def __init__(self) -> None:
        self._times: array[float] = array("d")
        self._names: list[str] = []
        self._newcomers: list[Newcomer] = []
        self._index: dict[str, int] = {}  # of a vehicle in both lists
        self._sights = _Columns()
        self._row: dict[str, int] = {}  # of a vehicle in the columns, in this step
        self._touching: dict[tuple[str, str], list[int]] = {}  # pair -> first and last step
        self._lights: dict[str, list[str]] = {}  # junction -> the state in each step

    def begin(self, scenario: Scenario, network: Network, logs: Mapping[str, Log]) -> None:
        """Take note of what runs, and where."""
        self._scenario, self._network, self._logs = scenario, network, logs
        on_the_right = network.intersections[0].driving_side == "right"
        self._inwards = 1 if on_the_right else -1  # side of the centre line, 1 is left

    def strangers(self, poses: Iterable[Pose]) -> list[str]:
        """The vehicles that have not been met."""
        return [pose.id for pose in poses if pose.id not in self._index]

    def meet(self, vehicle: str, newcomer: Newcomer) -> None:
        """Take note of a vehicle that appears."""
        self._index[vehicle] = len(self._names)
        self._names.append(vehicle)
        self._newcomers.append(newcomer)

    def see(
        self,
        time: float,
        poses: Collection[Pose],
        colliding: Iterable[tuple[str, str]],
        lights: Mapping[str, str],
    ) -> None:
        """Take note of a step."""
        step = len(self._times)
        self._times.append(time)
        self._row = {pose.id: len(self._sights.step) + i for i, pose in enumerate(poses)}
        for pose in poses:
            self._sights.append(step, self._index[pose.id], pose)
        for pair in colliding:
            self._touching.setdefault(pair, [step, step])[1] = step
        for junction, state in lights.items():
            self._lights.setdefault(junction, []).append(state)

    def order(self, orders: Orders) -> None:
        """Take note of what RVs are told in this step."""
        for vehicle, command in orders.told.items():
            if (row := self._row.get(vehicle)) is not None:
                told, acceleration, side = _spoken(command, vehicle in orders.held_back)
                self._sights.told[row] = told
                self._sights.acceleration[row] = acceleration
                self._sights.side[row] = side * self._inwards

    def trajectories(self, record: Record) -> Trajectories:
        """What was kept, when the episode is over.

        Args:
            record: what the episode left behind.
        """
        scenario, network, logs = self._scenario, self._network, self._logs
        seen = {
            name: Sights.of(junction, logs[name]) for name, junction in network.junctions.items()
        }
        classes = self._classes()
        order, vehicles = self._by_vehicle(list(classes))
        start = metrics.window_start(self._times, scenario.evaluation.warm_up)
        return Trajectories(
            title=scenario.title,
            record=record,
            step=scenario.evaluation.step,
            start=self._times[0],
            steps=len(self._times),
            warm_up=scenario.evaluation.warm_up,
            ground=ground_of(scenario, network),
            classes=list(classes.values()),
            vehicles=vehicles,
            tracks=self._tracks(order, vehicles, seen, scenario.evaluation.step),
            curves=[
                curves_of(
                    junction.intersection, logs[name], seen[name], self._lights.get(name, []), start
                )
                for name, junction in network.junctions.items()
            ],
            collisions=self._collisions(start),
        )

    def _classes(self) -> dict[str, Silhouette]:
        return {
            newcomer.vehicle_class: Silhouette(
                newcomer.vehicle_class, newcomer.size.length, newcomer.size.width
            )
            for newcomer in self._newcomers
        }

    def _collisions(self, start: int) -> list[Collision]:
        touching = sorted(self._touching.items(), key=lambda item: item[1])
        return [
            Collision(first, last, (self._index[vehicle], self._index[other]), last >= start)
            for (vehicle, other), (first, last) in touching
        ]

    def _by_vehicle(self, classes: list[str]) -> tuple[Ints, Vehicles]:
        """The order that puts each vehicle's entries together, and the vehicles."""
        step, vehicle = np.asarray(self._sights.step), np.asarray(self._sights.vehicle)
        order = np.lexsort((step, vehicle)).astype(np.int64)
        counts = np.bincount(vehicle.astype(np.int64), minlength=len(self._names))
        firsts = step[order][np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)]
        return order, Vehicles(
            id=self._names,
            kind=[classes.index(newcomer.vehicle_class) for newcomer in self._newcomers],
            robot=[newcomer.is_robot for newcomer in self._newcomers],
            movement=[newcomer.movement for newcomer in self._newcomers],
            first=[int(first) for first in firsts],
            steps=[int(count) for count in counts],
        )

    def _tracks(
        self, order: Ints, vehicles: Vehicles, seen: Mapping[str, Sights], step: float
    ) -> Tracks:
        """Everybody's entries, one vehicle after another."""
        kept = self._sights
        in_zone, waited = np.zeros(len(order), dtype=np.int64), np.zeros(len(order), dtype=np.int64)
        for name, sights in seen.items():
            here, stood = self._standing(self._logs[name], sights, step)
            in_zone |= here[order]
            waited += _each(np.maximum.accumulate, stood[order], vehicles.steps)
        return Tracks(
            x=np.asarray(kept.x)[order],
            y=np.asarray(kept.y)[order],
            angle=_each(_unwrapped, np.asarray(kept.angle)[order], vehicles.steps),
            speed=np.asarray(kept.speed)[order],
            told=np.asarray(kept.told, dtype=np.int64)[order],
            acceleration=np.asarray(kept.acceleration)[order],
            side=np.asarray(kept.side, dtype=np.int64)[order],
            in_zone=in_zone,
            waited=waited,
        )

    def _standing(self, log: Log, seen: Sights, step: float) -> tuple[Ints, Ints]:
        """By entry: whether the vehicle is in a zone, and in how many steps it stood there."""
        steps = len(self._times)
        vehicle = np.asarray(self._sights.vehicle, dtype=np.int64)
        place = np.full(len(self._names) * steps, -1, dtype=np.int64)
        place[vehicle * steps + np.asarray(self._sights.step)] = np.arange(len(vehicle))
        known = np.asarray([self._index[vehicle.id] for vehicle in log.vehicles], dtype=np.int64)
        rows = place[known[seen.vehicle] * steps + seen.step]
        here, stood = np.zeros(len(vehicle), dtype=np.int64), np.zeros(len(vehicle), dtype=np.int64)
        here[rows] = 1
        stood[rows] = np.rint(seen.waiting / step)
        return here, stood


class _Columns:
    """The log of every vehicle in every step, in columns that take little memory."""

    def __init__(self) -> None:
        self.step: array[int] = array("l")
        self.vehicle: array[int] = array("l")
        self.x: array[float] = array("d")
        self.y: array[float] = array("d")
        self.angle: array[float] = array("d")
        self.speed: array[float] = array("d")
        self.told: array[int] = array("b")
        self.acceleration: array[float] = array("d")
        self.side: array[int] = array("b")

    def append(self, step: int, vehicle: int, pose: Pose) -> None:
        self.step.append(step)
        self.vehicle.append(vehicle)
        self.x.append(pose.x)
        self.y.append(pose.y)
        self.angle.append(pose.angle)
        self.speed.append(pose.speed)
        self.told.append(Told.NOTHING)
        self.acceleration.append(0.0)
        self.side.append(0)


def _spoken(command: Command, held_back: bool) -> tuple[Told, float, int]:
    """A command as what was told, its acceleration and its lane change."""
    if isinstance(command, Drive):
        return Told.DRIVE, command.acceleration, command.lane_change
    if isinstance(command, Go):
        return (Told.HELD if held_back else Told.GO), 0.0, 0
    return (Told.STOP if isinstance(command, Stop) else Told.NOTHING), 0.0, 0


def _each(change: Callable[[Any], Any], values: Any, counts: Sequence[int]) -> Any:
    """Values with a change made to each vehicle's part."""
    parts = np.split(values, np.cumsum(counts)[:-1])
    return np.concatenate([change(part) for part in parts]) if len(values) else values


def _unwrapped(angle: Floats) -> Floats:
    return np.unwrap(angle, period=360.0)

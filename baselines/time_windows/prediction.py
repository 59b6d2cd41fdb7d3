"""When vehicles reach the entrance, and when they will be on each conflict stretch."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baselines.time_windows.stretches import Conflicts, Numbers
from benchmark.control.state import Crossing, Vehicle

PASSED = -1e6  # s, a window that lies behind; finite, so that differences of times stay numbers


class Passage(NamedTuple):
    """How a vehicle is expected to pass: with ``speed`` at ``origin``, from there on faster."""

    id: str
    way: int  # index into Conflicts.ways
    time: float  # s from now: at the entrance, or 0 for a vehicle inside
    origin: float  # m behind the entrance: 0, or where a vehicle inside is
    speed: float  # m/s at the origin
    fastest: float  # m/s on its way through
    length: float  # m
    delay: float  # s by which it may leave later than that
    yields: bool  # whether it is an HV before the entrance, which stops for whoever is inside


class Windows(NamedTuple):
    """When vehicles are on their conflict stretches.

    ``enter[v, j]`` and ``leave[v, j]`` [s from now]: vehicle v on the stretch that its way shares
    with way j; NaN where the two never meet, PASSED where it has left the stretch behind.
    """

    ways: npt.NDArray[np.intp]  # (vehicles,)
    arrival: Numbers  # (vehicles,) s from now at the entrance, 0 for vehicles inside
    yields: npt.NDArray[np.bool_]  # (vehicles,)
    enter: Numbers  # (vehicles, ways)
    leave: Numbers  # (vehicles, ways)


@dataclass(frozen=True, slots=True)
class Predictor:
    """Turns what is seen into passages and passages into windows.

    Args:
        conflicts: of the intersection.
        acceleration: with which vehicles speed up [m/s2].
        headway: least time at the entrance behind the vehicle ahead in the lane [s].
        creeping: a vehicle inside that is slower than this may be held up [m/s].
        creeping_delay: by how much later it may then leave its stretches [s].
    """

    conflicts: Conflicts
    acceleration: float
    headway: float
    creeping: float
    creeping_delay: float

    def approaching(self, vehicle: Vehicle, way: int, ahead: Passage | None) -> Passage:
        """The passage of a vehicle before the entrance.

        Args:
            vehicle: it.
            way: the index of its way.
            ahead: the passage of the vehicle ahead of it in its lane.
        """
        fastest = min(self.conflicts.ways[way].speed_limit, vehicle.body.maximum_speed)
        time, speed = self._arrival(vehicle.distance, min(vehicle.speed, fastest), fastest)
        if ahead is not None:
            time = max(time, ahead.time + self.headway)
        length = vehicle.body.length
        return Passage(
            vehicle.id, way, time, 0.0, speed, fastest, length, 0.0, not vehicle.is_robot
        )

    def inside(self, crossing: Crossing, way: int) -> Passage:
        """The passage of a vehicle that has entered."""
        fastest = min(self.conflicts.ways[way].speed_limit, crossing.body.maximum_speed)
        delay = self.creeping_delay if crossing.speed < self.creeping else 0.0
        speed, length = min(crossing.speed, fastest), crossing.body.length
        return Passage(
            crossing.id, way, 0.0, crossing.position, speed, fastest, length, delay, False
        )

    def _arrival(self, distance: float, speed: float, fastest: float) -> tuple[float, float]:
        """Time for a distance from a speed [s], and the speed at its end [m/s]."""
        speeding_up = (fastest * fastest - speed * speed) / (2 * self.acceleration)
        if distance < speeding_up:
            reached = math.sqrt(speed * speed + 2 * self.acceleration * distance)
            return (reached - speed) / self.acceleration, reached
        rest = distance - speeding_up
        return (fastest - speed) / self.acceleration + rest / fastest, fastest

    def windows(self, passages: Sequence[Passage]) -> Windows:
        """When each vehicle's front enters and its rear leaves the stretches of its way."""
        _, way, *numbers, delay, yields = zip(*passages, strict=True)
        ways = np.array(way, dtype=np.intp)
        time, origin, speed, fastest, length = np.array(numbers, dtype=np.float64)[:, :, None]
        start = self.conflicts.start[ways] - origin
        end = self.conflicts.end[ways] + length - origin
        enter, leave = time + self._durations(np.stack([start, end]), speed, fastest)
        leave += np.array(delay)[:, None]
        passed = end < 0.0
        enter[passed] = leave[passed] = PASSED
        return Windows(ways, time[:, 0], np.array(yields), enter, leave)

    def _durations(self, distances: Numbers, speed: Numbers, fastest: Numbers) -> Numbers:
        """``_arrival`` for arrays: the times for distances [s]; 0 for what lies behind."""
        distances = np.maximum(distances, 0.0)
        speeding_up = (fastest * fastest - speed * speed) / (2 * self.acceleration)
        gaining = np.sqrt(speed * speed + 2 * self.acceleration * distances) - speed
        at_full_speed = (distances - speeding_up) / fastest
        return np.where(
            distances < speeding_up,
            gaining / self.acceleration,
            (fastest - speed) / self.acceleration + at_full_speed,
        )

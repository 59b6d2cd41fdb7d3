"""What the tuned low level observes: its lane, those beside it, and whom it could lead there."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from baselines.hierarchical.observation import beside
from baselines.time_windows.queues import Queue
from benchmark.control.intersection import Intersection
from benchmark.control.state import STATIONARY, TrafficState, Vehicle
from benchmark.learning.observation import Numbers

FAR = 100.0  # m, observed as 1
FAST = 20.0  # m/s, observed as 1
LONG = 60.0  # s, observed as 1
MANY = 4.0  # vehicles, observed as 1


class Beside(NamedTuple):
    """A lane as an RV at some place in it, or beside it, sees it."""

    led: bool  # whether an RV is ahead
    unled: int  # HVs ahead that no RV leads
    followers: int  # HVs behind, up to the next RV, that it alone would lead
    ahead: float  # m from front to front to the next vehicle ahead; FAR without one
    behind: float  # m to the next vehicle behind
    speed: float  # m/s of the next vehicle ahead; FAST without one


NOWHERE = Beside(False, 0, 0, 0.0, 0.0, 0.0)

_EGO = 6  # distance, speed, waiting, left turn, refused, standing inside
_TRAFFIC = 2  # share of RVs in the control zone, standing vehicles of the own approach
_LANE = len(Beside._fields)
SIZE = _EGO + _TRAFFIC + _LANE + 2 * (1 + _LANE)  # own lane, and whether each side serves


class LocalObserver:
    """Turns traffic into the tuned low level's observations.

    Args:
        intersection: where.
    """

    def __init__(self, intersection: Intersection) -> None:
        self._intersection = intersection
        self._beside = beside(intersection)
        self._refused: Collection[str] = ()
        self._lanes: dict[str, list[Vehicle]] = {}

    def look(self, queues: Sequence[Queue], refused: Collection[str]) -> None:
        """Take note of the lanes' vehicles and of the ids of the RVs that may not enter now."""
        self._refused = refused
        self._lanes = {queue.lane: queue.vehicles for queue in queues}

    def observe(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """What each ego observes.

        Args:
            state: the traffic now.
            egos: RVs on the lanes that were looked at.

        Returns:
            Shape (egos, ``SIZE``), every number in [0, 1].
        """
        robots = sum(vehicle.is_robot for vehicle in state.vehicles)
        share = robots / max(1, len(state.vehicles))
        inside = sum(crossing.speed < STATIONARY for crossing in state.inside)
        standing = self._standing()
        rows = [
            (
                *self._ego(ego, inside),
                share,
                standing[self._intersection.lanes[ego.lane].approach] / (2 * MANY),
                *_numbers(self._seen(ego, ego.lane)),
                *self._side(ego, 0),
                *self._side(ego, 1),
            )
            for ego in egos
        ]
        return np.clip(np.array(rows, dtype=np.float32).reshape(-1, SIZE), 0.0, 1.0)

    def _ego(self, ego: Vehicle, inside: int) -> tuple[float, ...]:
        return (
            ego.distance / FAR,
            ego.speed / FAST,
            ego.waiting / LONG,
            self._intersection.movements[ego.movement].turn == "L",
            ego.id in self._refused,
            inside / MANY,
        )

    def _standing(self) -> dict[str, int]:
        """Standing vehicles by approach."""
        standing = dict.fromkeys((lane.approach for lane in self._intersection.lanes.values()), 0)
        for name, vehicles in self._lanes.items():
            approach = self._intersection.lanes[name].approach
            standing[approach] += sum(vehicle.speed < STATIONARY for vehicle in vehicles)
        return standing

    def _side(self, ego: Vehicle, index: int) -> tuple[float, ...]:
        lane = self._beside[ego.lane][index]
        if lane is None or ego.movement not in self._intersection.lanes[lane].movements:
            return (0.0, *_numbers(NOWHERE))
        return (1.0, *_numbers(self._seen(ego, lane)))

    def _seen(self, ego: Vehicle, lane: str) -> Beside:
        """A lane from the place of an ego, which may be on it."""
        led, unled, followers = False, 0, 0
        ahead, behind, speed = FAR, FAR, FAST
        for vehicle in self._lanes.get(lane, ()):
            if vehicle.id == ego.id:
                continue
            gap = ego.distance - vehicle.distance
            if gap >= 0:
                led |= vehicle.is_robot
                unled += not led
                ahead, speed = gap, vehicle.speed
            elif vehicle.is_robot:
                behind = min(behind, -gap)
                break
            else:
                behind = min(behind, -gap)
                followers += 1
        return Beside(led, unled, 0 if led else followers, ahead, behind, speed)


def _numbers(place: Beside) -> tuple[float, ...]:
    return (
        place.led,
        place.unled / MANY,
        place.followers / MANY,
        place.ahead / FAR,
        place.behind / FAR,
        place.speed / FAST,
    )

"""RVs spread over the lanes of their movement, so that more lanes are led by one."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Literal

from baselines.time_windows.queues import Queue
from benchmark.control.intersection import Intersection, Lane
from benchmark.control.state import Vehicle

Side = Literal[-1, 1]
SIDES: tuple[Side, Side] = (1, -1)  # left, right


def lane_changes(
    intersection: Intersection,
    queues: Sequence[Queue],
    stay: Collection[str],
    nearest: float,
    gap: float,
) -> Iterator[tuple[Vehicle, Side]]:
    """RVs that follow an RV and would lead the next lane, where there is room for them.

    Args:
        intersection: where.
        queues: of all lanes.
        stay: ids of RVs that keep their lane.
        nearest: nobody changes lanes closer to the entrance than this [m].
        gap: between the fronts of an RV and of any vehicle in its new lane [m].

    Yields:
        An RV and the side it should go to; at most one RV to each lane.
    """
    beside = {(lane.approach, lane.index): lane for lane in intersection.lanes.values()}
    vehicles = {queue.lane: queue.vehicles for queue in queues}
    taken: set[str] = set()
    for queue in queues:
        robots = [vehicle for vehicle in queue.vehicles if vehicle.is_robot]
        for vehicle in robots[1:]:
            if vehicle.distance < nearest or vehicle.id in stay:
                continue
            for side in SIDES:
                lane = intersection.lanes[queue.lane]
                other = beside.get((lane.approach, lane.index + side))
                if (
                    other is not None
                    and other.id not in taken
                    and _would_lead(vehicle, other, vehicles.get(other.id, []), gap)
                ):
                    taken.add(other.id)
                    yield vehicle, side
                    break


def _would_lead(vehicle: Vehicle, lane: Lane, there: Sequence[Vehicle], gap: float) -> bool:
    """Whether a vehicle would be the first RV of a lane and has room in it."""
    if vehicle.movement not in lane.movements:
        return False
    first = min((neighbour.distance for neighbour in there if neighbour.is_robot), default=math.inf)
    return vehicle.distance < first and all(
        abs(neighbour.distance - vehicle.distance) >= gap for neighbour in there
    )


def speeding_up(vehicle: Vehicle, limits: Mapping[str, Lane], step: float) -> float:
    """The acceleration of free driving [m/s2]."""
    fastest = min(vehicle.body.maximum_speed, limits[vehicle.lane].speed_limit)
    return min(max(0.0, (fastest - vehicle.speed) / step), vehicle.body.acceleration)

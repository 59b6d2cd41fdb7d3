"""The vehicles of each lane, front first, and who leads whom."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from baselines.time_windows.prediction import Passage, Predictor
from benchmark.control.arbitration import stopping_speed
from benchmark.control.state import TrafficState, Vehicle

MARGIN = 0.5  # m by which RVs stop earlier than the rules have them stop


@dataclass(frozen=True, slots=True)
class Platoon:
    """An RV that can still stop, and the HVs between it and the next one."""

    leader: Vehicle
    index: int  # of the leader's passage
    followers: list[int] = field(default_factory=list)  # of the HVs' passages, front first


@dataclass(frozen=True, slots=True)
class Queue:
    """One lane."""

    lane: str
    vehicles: list[Vehicle]  # with a way from this lane, front first
    platoons: list[Platoon] = field(default_factory=list)  # those that arrive in time, front first


@dataclass(frozen=True, slots=True)
class Survey:
    """Everybody who counts now."""

    passages: list[Passage]
    committed: int  # bits of the passages that nobody can hold back
    queues: list[Queue]  # by lane id


def survey(
    state: TrafficState,
    ways: Mapping[tuple[str, str], int],
    predictor: Predictor,
    look_ahead: float,
) -> Survey:
    """Sort the traffic into those who cannot be held back and platoons that can.

    Args:
        state: the traffic now.
        ways: (movement, lane) -> index of the way.
        predictor: makes the passages.
        look_ahead: who arrives later than this does not count yet [s].
    """
    passages = [
        predictor.inside(crossing, ways[key])
        for crossing in state.inside
        if (key := (crossing.movement, crossing.lane)) in ways
    ]
    committed = (1 << len(passages)) - 1
    lanes: dict[str, list[Vehicle]] = {}
    for vehicle in state.vehicles:
        if (vehicle.movement, vehicle.lane) in ways:
            lanes.setdefault(vehicle.lane, []).append(vehicle)
    queues = []
    for lane in sorted(lanes):
        queue = Queue(lane, sorted(lanes[lane], key=lambda vehicle: (vehicle.distance, vehicle.id)))
        queues.append(queue)
        ahead = None
        for vehicle in queue.vehicles:
            ahead = predictor.approaching(vehicle, ways[vehicle.movement, lane], ahead)
            if ahead.time > look_ahead:
                break
            index = len(passages)
            passages.append(ahead)
            if vehicle.is_robot and (queue.platoons or can_stop(vehicle, state.intersection.step)):
                queue.platoons.append(Platoon(vehicle, index))
            elif queue.platoons:
                queue.platoons[-1].followers.append(index)
            else:
                committed |= 1 << index
    return Survey(passages, committed, queues)


def can_stop(vehicle: Vehicle, step: float) -> bool:
    """Whether a vehicle can still come to rest before the entrance.

    Args:
        vehicle: it.
        step: simulated time per step [s].
    """
    hardest = vehicle.body.deceleration
    slowest = max(0.0, vehicle.speed - hardest * step)
    return slowest <= stopping_speed(vehicle.distance - MARGIN, hardest, step)


def to_the_line(vehicle: Vehicle, braking: float, step: float) -> float:
    """The greatest acceleration with which a vehicle still stops before the entrance [m/s2].

    Args:
        vehicle: it.
        braking: with which it stops, positive [m/s2].
        step: simulated time per step [s].
    """
    wanted = stopping_speed(vehicle.distance - MARGIN, braking, step)
    return max((wanted - vehicle.speed) / step, -vehicle.body.deceleration)

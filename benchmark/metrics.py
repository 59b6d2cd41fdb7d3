"""Pure functions from what was observed to figures; the formula is in each docstring.

``w_v(t)``: seconds that vehicle v has been stationary (below 0.1 m/s) inside the control zone up
to time t, counted since it entered. The evaluation window holds the steps after ``warm_up``.
"""

from collections.abc import Callable, Collection, Iterable, Sequence

import numpy as np
import numpy.typing as npt

from benchmark.record import TripMetrics, Waiting
from benchmark.simulation import Trip
from benchmark.tracking import Log

CURVE_BIN = 10.0  # s

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def window_start(times: Sequence[float], warm_up: float) -> int:
    """The first step of the evaluation window: the first with a time after ``warm_up`` [s]."""
    return int(np.searchsorted(np.asarray(times), warm_up, side="right"))


def average_waiting_time(step: Ints, waiting: Floats) -> float | None:
    """Mean over steps of the mean ``w_v(t)`` over vehicles present [s]; None with no vehicle.

    ``(1/|T'|) sum_{t in T'} (1/n_t) sum_v w_v(t)``, where T' are the window's steps with a vehicle
    in the control zone (paper, Baselines and Evaluation Metric).

    Args:
        step: the step of each (vehicle, step) pair, shape (n,).
        waiting: ``w_v(t)`` of each pair [s], shape (n,).
    """
    if not len(step):
        return None
    present = np.bincount(step)
    total = np.bincount(step, weights=waiting)
    return float(np.mean(total[present > 0] / present[present > 0]))


def wang_waiting_time(
    step: Ints, movement: Ints, waiting: Floats, movements: int, steps: int
) -> float | None:
    """Mean over movements and steps of the mean ``w_v(t)`` per movement, empty ones as 0 [s].

    ``(1/(J T)) sum_t sum_j (1/n_{t,j}) sum_{v in j} w_v(t)``, as Wang et al.'s code averages.

    Args:
        step: of each pair, 0 for the window's first, shape (n,).
        movement: index of the regulated movement of each pair, shape (n,).
        waiting: ``w_v(t)`` of each pair [s], shape (n,).
        movements: J, the number of regulated movements.
        steps: T, the number of steps in the window.
    """
    if not movements or not steps:
        return None
    cell = step * movements + movement
    present = np.bincount(cell, minlength=movements * steps)
    total = np.bincount(cell, weights=waiting, minlength=movements * steps)
    return float(np.sum(total / np.maximum(present, 1)) / (movements * steps))


def waiting_of(finals: Collection[float]) -> Waiting | None:
    """Mean, 95th percentile and maximum of final waiting times; None for no vehicle."""
    if not finals:
        return None
    values = np.asarray(list(finals))
    return Waiting(
        mean=float(values.mean()),
        p95=float(np.percentile(values, 95)),
        maximum=float(values.max()),
        vehicles=len(values),
    )


def waiting_by(finals: dict[str, float], group: Callable[[str], str]) -> dict[str, Waiting]:
    """``waiting_of`` for each group of vehicles, by the groups' names."""
    groups: dict[str, list[float]] = {}
    for vehicle, waited in finals.items():
        groups.setdefault(group(vehicle), []).append(waited)
    return {name: found for name in sorted(groups) if (found := waiting_of(groups[name]))}


def final_waiting(log: Log, start: int) -> dict[str, float]:
    """Final ``w_v`` [s] of the vehicles that left the zone in the window or are in it at the end.

    Args:
        log: of the whole episode.
        start: the window's first step.
    """
    last = dict(zip(log.vehicle, zip(log.step, log.waiting, strict=True), strict=True))
    # a vehicle last seen in the step before the window left the zone in the window
    return {vehicle: waited for vehicle, (step, waited) in last.items() if step >= start - 1}


def throughput(crossed: Sequence[int], start: int, step: float) -> float:
    """Vehicles past the entrance per hour of the window [veh/h]."""
    window = crossed[start:]
    return 3600 * sum(window) / (len(window) * step) if window else 0.0


def curve(values: Sequence[float], step: float) -> tuple[float, ...]:
    """Means over bins of ten seconds, rounded to four digits."""
    size = max(1, round(CURVE_BIN / step))
    return tuple(
        round(float(np.mean(values[index : index + size])), 4)
        for index in range(0, len(values), size)
    )


def collisions(pairs: Iterable[tuple[str, str]], robots: Collection[str]) -> tuple[int, int]:
    """Unique pairs of vehicles that collided, and how many of these hold an RV."""
    unique = set(pairs)
    return len(unique), sum(one in robots or other in robots for one, other in unique)


def trip_metrics(
    trips: Sequence[Trip],
    warm_up: float,
    pairs: Iterable[tuple[str, str]],
    robots: Collection[str],
    emergency_brakings: int,
) -> TripMetrics:
    """The figures of whole trips.

    - ``time_loss``: mean over vehicles on the road at some time in the window, so that those stuck
      in a jam count.
    - ``travel_time``: mean over vehicles that arrived in the window.
    - ``insertion_delay``: mean over vehicles that entered in the window or still waited to enter
      at its end.
    - emissions: sums over the vehicles on the road in the window, per kilometre they drove.
    """
    on_road = [
        t for t in trips if t.depart is not None and (t.arrival is None or t.arrival > warm_up)
    ]
    arrived = [trip for trip in on_road if trip.arrival is not None]
    entering = [trip for trip in trips if trip.depart is None or trip.depart > warm_up]
    crashes, with_robot = collisions(pairs, robots)
    kilometres = sum(trip.distance for trip in on_road) / 1000

    def per_km(values: Iterable[float]) -> float | None:
        return sum(values) / kilometres if kilometres else None

    return TripMetrics(
        time_loss=_mean(trip.time_loss for trip in on_road),
        travel_time=_mean(trip.duration for trip in arrived),
        insertion_delay=_mean(trip.insertion_delay for trip in entering),
        never_inserted=sum(trip.depart is None for trip in trips),
        arrived=len(arrived),
        collisions=crashes,
        collisions_with_robot=with_robot,
        emergency_brakings=emergency_brakings,
        co2=per_km(trip.co2 for trip in on_road),
        nox=per_km(trip.nox for trip in on_road),
        fuel=per_km(trip.fuel for trip in on_road),
    )


def _mean(values: Iterable[float]) -> float | None:
    found = list(values)
    return float(np.mean(found)) if found else None

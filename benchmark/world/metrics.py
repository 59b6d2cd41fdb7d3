"""Pure functions from what was observed to figures; the formula is in each docstring.

``w_v(t)``: seconds that vehicle v has been stationary (below 0.1 m/s) inside the control zone up
to time t, counted since it entered; ``benchmark.world.tracking`` counts them. The evaluation window
holds the steps after ``warm_up``.

Sights are (step, vehicle) pairs: vehicle v is in the control zone at step t. Arrays of sights run
step by step.
"""

from collections.abc import Collection, Iterable, Sequence

import numpy as np
import numpy.typing as npt

from benchmark.records.record import TripMetrics, Waiting
from benchmark.sumo.simulation import Trip

CURVE_BIN = 10.0  # s

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


def window_start(times: Sequence[float], warm_up: float) -> int:
    """The first step of the evaluation window: the first with a time after ``warm_up`` [s]."""
    return int(np.searchsorted(np.asarray(times), warm_up, side="right"))


def average_waiting_time(step: Ints, waiting: Floats) -> float | None:
    """Mean over steps of the mean ``w_v(t)`` over vehicles present [s]; None with no vehicle.

    ``(1/|T'|) sum_{t in T'} (1/n_t) sum_v w_v(t)``, where T' are the window's steps with a vehicle
    in the control zone (paper, Baselines and Evaluation Metric).

    Args:
        step: of each sight in the window, shape (n,).
        waiting: ``w_v(t)`` of each sight [s], shape (n,).
    """
    if not len(step):
        return None
    present = np.bincount(step)
    total = np.bincount(step, weights=waiting)
    return float(np.mean(total[present > 0] / present[present > 0]))


def mean_waiting(step: Ints, waiting: Floats, steps: int) -> Floats:
    """The mean ``w_v(t)`` over the vehicles present, by step [s]; nan with no vehicle.

    Args:
        step: of each sight, shape (n,).
        waiting: ``w_v(t)`` of each sight [s], shape (n,).
        steps: how many steps there are.
    """
    present = np.bincount(step, minlength=steps)
    total = np.bincount(step, weights=waiting, minlength=steps)
    mean: Floats = np.divide(total, present, out=np.full(steps, np.nan), where=present > 0)
    return mean


def average_waiting_curve(step: Ints, waiting: Floats, steps: int, start: int) -> Floats:
    """``average_waiting_time`` of the window up to each step [s]; nan before its first vehicle.

    Args:
        step: of each sight of the episode, shape (n,).
        waiting: ``w_v(t)`` of each sight [s], shape (n,).
        steps: steps of the episode.
        start: the window's first step.
    """
    means = mean_waiting(step, waiting, steps)
    means[:start] = np.nan
    counted = np.cumsum(~np.isnan(means))
    total = np.cumsum(np.nan_to_num(means))
    mean: Floats = np.divide(total, counted, out=np.full(steps, np.nan), where=counted > 0)
    return mean


def wang_waiting_time(
    step: Ints, movement: Ints, waiting: Floats, movements: int, steps: int
) -> float | None:
    """Mean over movements and steps of the mean ``w_v(t)`` per movement, empty ones as 0 [s].

    ``(1/(J T)) sum_t sum_j (1/n_{t,j}) sum_{v in j} w_v(t)``, as Wang et al.'s code averages.

    Args:
        step: of each sight, 0 for the window's first, shape (n,).
        movement: index of the regulated movement of each sight, shape (n,).
        waiting: ``w_v(t)`` of each sight [s], shape (n,).
        movements: J, the number of regulated movements.
        steps: T, the number of steps in the window.
    """
    if not movements or not steps:
        return None
    cell = step * movements + movement
    present = np.bincount(cell, minlength=movements * steps)
    total = np.bincount(cell, weights=waiting, minlength=movements * steps)
    return float(np.sum(total / np.maximum(present, 1)) / (movements * steps))


def waiting_of(finals: Floats) -> Waiting | None:
    """Mean, 95th percentile and maximum of final waiting times [s]; None for no vehicle."""
    if not len(finals):
        return None
    return Waiting(
        mean=float(finals.mean()),
        p95=float(np.percentile(finals, 95)),
        maximum=float(finals.max()),
        vehicles=len(finals),
    )


def waiting_by(finals: Floats, groups: Sequence[str]) -> dict[str, Waiting]:
    """``waiting_of`` for each group of vehicles, by the groups' names.

    Args:
        finals: final waiting time of each vehicle [s], shape (n,).
        groups: the group of each vehicle.
    """
    labels = np.asarray(groups)
    return {
        str(name): waiting
        for name in np.unique(labels)
        if (waiting := waiting_of(finals[labels == name]))
    }


def last_sights(step: Ints, vehicle: Ints, start: int) -> Ints:
    """Where each vehicle is seen last, of those that left in the window or are there at the end.

    A vehicle last seen in the step before the window left in the window.

    Args:
        step: of each sight of the episode, shape (n,).
        vehicle: of each sight, shape (n,).
        start: the window's first step.

    Returns:
        Indices of sights, one per vehicle, in ascending order of vehicles.
    """
    _, from_end = np.unique(vehicle[::-1], return_index=True)
    last = len(vehicle) - 1 - from_end
    return np.asarray(last[step[last] >= start - 1], dtype=np.int64)


def throughput(last_step: Ints, start: int, steps: int, step: float) -> float:
    """Vehicles past the entrance per hour of the window [veh/h].

    Args:
        last_step: the step of each vehicle's last sight; unless that is the episode's last step
            the vehicle passed the entrance in the next.
        start: the window's first step.
        steps: steps of the episode.
        step: simulated time per step [s].
    """
    passed = np.count_nonzero((last_step >= start - 1) & (last_step < steps - 1))
    return float(3600 * passed / ((steps - start) * step)) if steps > start else 0.0


def lane_changes(step: Ints, vehicle: Ints, lane: Ints, row: Ints, start: int) -> int:
    """Lane changes in the control zone during the window.

    Args:
        step: of each sight of the episode, shape (n,).
        vehicle: of each sight, shape (n,).
        lane: of each sight, shape (n,).
        row: by lane, which lanes lie beside each other: to go from one to another of the same row
            is a change, to another row is driving on.
        start: the window's first step.
    """
    order = np.lexsort((step, vehicle))
    before, after = order[:-1], order[1:]
    moved = (
        (vehicle[before] == vehicle[after])
        & (step[after] >= start)
        & (lane[before] != lane[after])
        & (row[lane[before]] == row[lane[after]])
    )
    return int(np.count_nonzero(moved))


def unregulated_ratios(
    step: Ints, lane: Ints, is_robot: Bools, regulated: Bools, steps: int
) -> Floats:
    """The share of left and cross lanes without an RV on them, by step.

    Args:
        step: of each sight of the episode, shape (n,).
        lane: of each sight, shape (n,).
        is_robot: whether each sight is of an RV, shape (n,).
        regulated: by lane, whether it is a left or cross lane at the entrance.
        steps: steps of the episode.
    """
    led = is_robot & regulated[lane]
    pairs = np.unique(step[led] * len(regulated) + lane[led])
    lanes_led = np.bincount(pairs // len(regulated), minlength=steps)
    return 1 - lanes_led / np.count_nonzero(regulated)


def curve(values: Floats, step: float) -> tuple[float, ...]:
    """Means over bins of ten seconds, rounded to four digits."""
    size = max(1, round(CURVE_BIN / step))
    return tuple(
        round(float(np.mean(values[index : index + size])), 4)
        for index in range(0, len(values), size)
    )


def collisions(pairs: Iterable[tuple[str, str]], robots: Collection[str]) -> tuple[int, int]:
    """Unique pairs of vehicles that collided, and how many of these hold an RV."""
    unique = set(pairs)
    return len(unique), sum(first in robots or second in robots for first, second in unique)


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
    - emissions: over the vehicles on the road in the window whose emissions SUMO recorded, their
      sum per kilometre they drove.
    """
    on_road = [
        trip
        for trip in trips
        if trip.depart is not None and (trip.arrival is None or trip.arrival > warm_up)
    ]
    arrived = [trip for trip in on_road if trip.arrival is not None]
    entering = [trip for trip in trips if trip.depart is None or trip.depart > warm_up]
    crashes, with_robot = collisions(pairs, robots)
    emitted = [
        (trip.emissions, trip.distance / 1000) for trip in on_road if trip.emissions is not None
    ]
    kilometres = sum(distance for _, distance in emitted)

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
        co2=per_km(emissions.co2 for emissions, _ in emitted),
        nox=per_km(emissions.nox for emissions, _ in emitted),
        fuel=per_km(emissions.fuel for emissions, _ in emitted),
    )


def _mean(values: Iterable[float]) -> float | None:
    numbers = list(values)
    return float(np.mean(numbers)) if numbers else None

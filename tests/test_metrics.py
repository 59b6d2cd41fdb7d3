"""The figures, by hand and against slow loops that follow the formulas word by word."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmark import metrics
from benchmark.record import Waiting
from benchmark.simulation import Trip
from benchmark.tracking import Log

MOVEMENTS = 3
SECONDS = st.floats(0, 1000).map(lambda value: round(value, 1))
ROWS = st.lists(st.tuples(st.integers(0, 6), st.integers(0, MOVEMENTS - 1), SECONDS), max_size=40)
Row = tuple[int, int, float]  # step, movement, w_v(t)


def average(rows: Sequence[Row]) -> float | None:
    return metrics.average_waiting_time(
        np.array([step for step, _, _ in rows], dtype=np.int64),
        np.array([waited for _, _, waited in rows], dtype=np.float64),
    )


def wang(rows: Sequence[Row], movements: int = MOVEMENTS, steps: int = 7) -> float | None:
    return metrics.wang_waiting_time(
        np.array([step for step, _, _ in rows], dtype=np.int64),
        np.array([movement for _, movement, _ in rows], dtype=np.int64),
        np.array([waited for _, _, waited in rows], dtype=np.float64),
        movements,
        steps,
    )


def mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


# --- waiting ---------------------------------------------------------------------------------


def test_average_waiting_is_a_mean_of_means_over_steps_with_a_vehicle() -> None:
    rows = [(2, 0, 1.0), (2, 1, 3.0), (5, 0, 8.0)]  # (1 + 3) / 2 = 2 and 8; steps 3 and 4 empty
    assert average(rows) == 5.0


def test_wang_waiting_counts_empty_movements_and_steps_as_zero() -> None:
    rows = [(0, 0, 1.0), (0, 0, 3.0), (0, 1, 4.0), (1, 1, 6.0)]
    assert wang(rows, movements=2, steps=3) == pytest.approx((2 + 4 + 0 + 6 + 0 + 0) / 6)


def test_a_lone_vehicle_that_never_stands_waits_0() -> None:
    rows = [(step, 0, 0.0) for step in range(5)]
    assert average(rows) == 0.0
    assert wang(rows) == 0.0
    assert metrics.waiting_of([0.0]) == Waiting(mean=0, p95=0, maximum=0, vehicles=1)


def test_nothing_to_count_gives_no_figure() -> None:
    assert average([]) is None
    assert wang([], movements=0) is None
    assert wang([], steps=0) is None
    assert metrics.waiting_of([]) is None
    assert metrics.waiting_by({}, str) == {}
    assert metrics.final_waiting(Log(), 0) == {}
    assert metrics.curve([], 1.0) == ()


@given(rows=ROWS)
def test_average_waiting_follows_the_papers_formula(rows: list[Row]) -> None:
    by_step = [[w for t, _, w in rows if t == step] for step in range(7)]
    means = [mean(present) for present in by_step if present]
    assert average(rows) == (pytest.approx(mean(means)) if means else None)


@given(rows=ROWS)
def test_wang_waiting_follows_wangs_code(rows: list[Row]) -> None:
    total = 0.0
    for step in range(7):
        for movement in range(MOVEMENTS):
            present = [w for t, j, w in rows if (t, j) == (step, movement)]
            total += mean(present) if present else 0.0
    assert wang(rows) == pytest.approx(total / (7 * MOVEMENTS))


@given(finals=st.lists(SECONDS, min_size=1))
def test_waiting_per_vehicle_has_mean_percentile_and_maximum(finals: list[float]) -> None:
    ordered = sorted(finals)
    place = 0.95 * (len(ordered) - 1)
    low = int(place)
    above = ordered[min(low + 1, len(ordered) - 1)]
    found = metrics.waiting_of(finals)
    assert found is not None
    assert found.mean == pytest.approx(mean(finals))
    assert found.p95 == pytest.approx(ordered[low] + (place - low) * (above - ordered[low]))
    assert found.maximum == ordered[-1]
    assert found.vehicles == len(finals)


def test_waiting_is_grouped_by_name() -> None:
    found = metrics.waiting_by({"b1": 1.0, "a1": 5.0, "b2": 3.0}, lambda vehicle: vehicle[0])
    assert list(found) == ["a", "b"]
    assert (found["b"].mean, found["b"].vehicles, found["a"].maximum) == (2.0, 2, 5.0)


def test_final_waiting_holds_those_that_left_in_the_window_or_are_still_there() -> None:
    log = Log()
    seen = {"before": range(2), "at its edge": range(3), "during": range(5), "still": range(4, 7)}
    for step in range(7):
        for name in (name for name, steps in seen.items() if step in steps):
            log.step.append(step)
            log.vehicle.append(name)
            log.waiting.append(10.0 * step)
    assert metrics.final_waiting(log, start=3) == {"at its edge": 20, "during": 40, "still": 60}
    assert set(metrics.final_waiting(log, start=0)) == set(seen)


# --- the window, counts and curves -----------------------------------------------------------


@given(warm_up=st.floats(0, 12), step=st.sampled_from([0.1, 0.5, 1.0]))
def test_the_window_holds_the_steps_after_the_warm_up(warm_up: float, step: float) -> None:
    times = [round(step * number, 3) for number in range(1, 21)]
    start = metrics.window_start(times, warm_up)
    assert times[start:] == [time for time in times if time > warm_up]


def test_throughput_is_crossings_per_hour_of_the_window() -> None:
    assert metrics.throughput([9, 1, 2, 3], start=1, step=0.5) == 3600 * 6 / 1.5
    assert metrics.throughput([9], start=1, step=0.5) == 0.0


@given(values=st.lists(st.floats(0, 1), max_size=60), step=st.sampled_from([0.5, 1.0, 3.0]))
def test_a_curve_holds_the_mean_of_every_ten_seconds(values: list[float], step: float) -> None:
    size = {0.5: 20, 1.0: 10, 3.0: 3}[step]
    bins = [values[first : first + size] for first in range(0, len(values), size)]
    assert metrics.curve(values, step) == pytest.approx([mean(b) for b in bins], abs=5.1e-5)


def test_collisions_are_unique_pairs_and_those_with_an_rv_apart() -> None:
    pairs = [("a", "b"), ("a", "b"), ("b", "c"), ("c", "d")]
    assert metrics.collisions(pairs, {"a", "c"}) == (3, 3)
    assert metrics.collisions(pairs, {"d"}) == (3, 1)
    assert metrics.collisions([], {"a"}) == (0, 0)


# --- trips -----------------------------------------------------------------------------------


def trip(depart: float | None, arrival: float | None, **facts: Any) -> Trip:
    settled = {"insertion_delay": 0.0, "duration": 0.0, "time_loss": 0.0, "distance": 1000.0}
    settled |= {"co2": 0.0, "nox": 0.0, "fuel": 0.0}
    return Trip(id="v", depart=depart, arrival=arrival, **{**settled, **facts})


def test_trip_figures_count_who_was_there_in_the_window() -> None:
    early = trip(0, 90, time_loss=99, duration=90, co2=999)
    across = trip(50, 150, time_loss=10, duration=100, insertion_delay=70, co2=300, distance=500)
    stuck = trip(120, None, time_loss=40, duration=80, insertion_delay=4, co2=100, nox=50)
    outside = trip(None, None, insertion_delay=20, distance=0)
    found = metrics.trip_metrics(
        [early, across, stuck, outside], 100, [("a", "b")], {"a"}, emergency_brakings=3
    )
    assert found.time_loss == (10 + 40) / 2
    assert found.travel_time == 100
    assert found.arrived == 1
    assert found.insertion_delay == (4 + 20) / 2
    assert found.never_inserted == 1
    assert (found.collisions, found.collisions_with_robot, found.emergency_brakings) == (1, 1, 3)
    assert (found.co2, found.fuel) == (pytest.approx(400 / 1.5), 0)
    assert found.nox == pytest.approx(50 / 1.5)


def test_without_trips_there_are_no_trip_figures() -> None:
    found = metrics.trip_metrics([], 0, [], set(), 0)
    means = (found.time_loss, found.travel_time, found.insertion_delay)
    assert (*means, found.co2, found.nox, found.fuel) == (None,) * 6
    assert (found.arrived, found.never_inserted, found.collisions) == (0, 0, 0)

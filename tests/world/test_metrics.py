"""The figures, by hand and against slow loops that follow the formulas word by word."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmark.records.record import Waiting
from benchmark.sumo.simulation import Emissions, Trip
from benchmark.world import metrics

MOVEMENTS = 3
SECONDS = st.floats(0, 1000).map(lambda value: round(value, 1))
ROWS = st.lists(st.tuples(st.integers(0, 6), st.integers(0, MOVEMENTS - 1), SECONDS), max_size=40)
Row = tuple[int, int, float]  # step, movement, w_v(t)


def integers(values: Iterable[int]) -> metrics.Ints:
    return np.array(list(values), dtype=np.int64)


def numbers(values: Iterable[float]) -> metrics.Floats:
    return np.array(list(values), dtype=np.float64)


def average(rows: Sequence[Row]) -> float | None:
    return metrics.average_waiting_time(
        integers(step for step, _, _ in rows), numbers(waited for _, _, waited in rows)
    )


def wang(rows: Sequence[Row], movements: int = MOVEMENTS, steps: int = 7) -> float | None:
    return metrics.wang_waiting_time(
        integers(step for step, _, _ in rows),
        integers(movement for _, movement, _ in rows),
        numbers(waited for _, _, waited in rows),
        movements,
        steps,
    )


def mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


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
    assert metrics.waiting_of(numbers([0.0])) == Waiting(mean=0, p95=0, maximum=0, vehicles=1)


def test_nothing_to_count_gives_no_figure() -> None:
    assert average([]) is None
    assert wang([], movements=0) is None
    assert wang([], steps=0) is None
    assert metrics.waiting_of(numbers([])) is None
    assert metrics.waiting_by(numbers([]), []) == {}
    assert len(metrics.last_sights(integers([]), integers([]), 0)) == 0
    assert metrics.throughput(integers([]), start=0, steps=9, step=1.0) == 0.0
    assert metrics.throughput(integers([3]), start=9, steps=9, step=1.0) == 0.0
    assert metrics.lane_changes(*[integers([])] * 3, integers([0]), 0) == 0
    assert metrics.curve(numbers([]), 1.0) == ()


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
    found = metrics.waiting_of(numbers(finals))
    assert found is not None
    assert found.mean == pytest.approx(mean(finals))
    assert found.p95 == pytest.approx(ordered[low] + (place - low) * (above - ordered[low]))
    assert found.maximum == ordered[-1]
    assert found.vehicles == len(finals)


def test_waiting_is_grouped_by_name() -> None:
    found = metrics.waiting_by(numbers([1.0, 5.0, 3.0]), ["b", "a", "b"])
    assert list(found) == ["a", "b"]
    assert (found["b"].mean, found["b"].vehicles, found["a"].maximum) == (2.0, 2, 5.0)


STEPS = 7
STAYS = st.lists(
    st.tuples(st.integers(0, STEPS - 1), st.integers(0, STEPS - 1)).map(sorted), max_size=6
)  # a vehicle's first and last step in the zone
STARTS = st.integers(0, STEPS - 1)


def sights(stays: Sequence[Sequence[int]]) -> tuple[metrics.Ints, metrics.Ints]:
    """The step and the vehicle of each sight, step by step."""
    found = [
        (step, vehicle)
        for step in range(STEPS)
        for vehicle, (first, last) in enumerate(stays)
        if first <= step <= last
    ]
    return integers(step for step, _ in found), integers(vehicle for _, vehicle in found)


def test_final_waiting_holds_those_that_left_in_the_window_or_are_still_there() -> None:
    step, vehicle = sights([(0, 1), (0, 2), (0, 4), (4, 6)])  # before, at its edge, during, still
    last = metrics.last_sights(step, vehicle, start=3)
    assert list(zip(vehicle[last], step[last], strict=True)) == [(1, 2), (2, 4), (3, 6)]
    assert list(vehicle[metrics.last_sights(step, vehicle, start=0)]) == [0, 1, 2, 3]


@given(stays=STAYS, start=STARTS)
def test_last_sights_agree_with_looking_for_each_vehicle(
    stays: list[list[int]], start: int
) -> None:
    step, vehicle = sights(stays)
    last = metrics.last_sights(step, vehicle, start)
    leaves = {name: end + 1 for name, (_, end) in enumerate(stays)}  # the first step without it
    there = {name: end - 1 for name, end in leaves.items() if end >= start}
    assert list(zip(vehicle[last], step[last], strict=True)) == list(there.items())


@given(stays=STAYS, start=STARTS, step=st.sampled_from([0.5, 1.0]))
def test_throughput_is_departures_from_the_zone_per_hour_of_the_window(
    stays: list[list[int]], start: int, step: float
) -> None:
    steps, vehicle = sights(stays)
    last = steps[metrics.last_sights(steps, vehicle, start)]
    passed = 0
    for now in range(start, STEPS):
        before = {name for name, (first, end) in enumerate(stays) if first <= now - 1 <= end}
        here = {name for name, (first, end) in enumerate(stays) if first <= now <= end}
        passed += len(before - here)
    hours = (STEPS - start) * step / 3600
    assert metrics.throughput(last, start, STEPS, step) == pytest.approx(passed / hours)


LANES = ("stop 0", "stop 1", "bay 0", "bay 1", "up 0", "up 1")
LANE_ROW = integers([0, 0, 1, 1, 2, 2])


@pytest.mark.parametrize(
    ("lanes", "changes"),
    [
        (["stop 0", "stop 1", "stop 0"], 2),
        (["stop 0", "stop 0"], 0),
        (["up 0", "up 1"], 1),
        (["up 1", "bay 0", "stop 1"], 0),
        (["up 1", "stop 0"], 0),
        (["up 0", "up 1", "bay 1", "bay 0", "stop 0"], 2),
    ],
)
def test_moving_over_is_a_lane_change_and_driving_on_is_not(lanes: list[str], changes: int) -> None:
    lane = integers(LANES.index(name) for name in lanes)
    step, vehicle = np.arange(len(lanes)), np.zeros(len(lanes), dtype=np.int64)
    assert metrics.lane_changes(step, vehicle, lane, LANE_ROW, start=0) == changes
    assert metrics.lane_changes(step, vehicle, lane, LANE_ROW, start=len(lanes)) == 0


PLACES = st.lists(
    st.dictionaries(st.integers(0, 3), st.integers(0, len(LANES) - 1)), min_size=1, max_size=8
)  # by step: vehicle -> lane


def seen(places: list[dict[int, int]]) -> list[metrics.Ints]:
    """Step, vehicle and lane of each sight."""
    found = [(t, v, lane) for t, now in enumerate(places) for v, lane in now.items()]
    return [integers(column) for column in zip(*found, strict=True)] or [integers([])] * 3


@given(places=PLACES, start=st.integers(0, 8))
def test_lane_changes_agree_with_following_each_vehicle(
    places: list[dict[int, int]], start: int
) -> None:
    known: dict[int, int] = {}
    changes = 0
    for step, now in enumerate(places):
        for vehicle, lane in now.items():
            before = known.get(vehicle, lane)
            if step >= start and before != lane and LANE_ROW[before] == LANE_ROW[lane]:
                changes += 1
        known |= now
    assert metrics.lane_changes(*seen(places), LANE_ROW, start) == changes


REGULATED = np.array([False, True, True, True, False, False])


@pytest.mark.parametrize(
    ("now", "share"),  # now: vehicle -> lane; odd ones are RVs
    [
        ({}, 1),
        ({0: 1}, 1),
        ({1: 1}, 2 / 3),
        ({1: 1, 3: 1}, 2 / 3),
        ({1: 1, 3: 2}, 1 / 3),
        ({1: 0}, 1),
        ({1: 4}, 1),
        ({1: 1, 3: 2, 5: 3}, 0),
    ],
)
def test_the_share_of_unregulated_lanes_counts_left_and_cross_lanes_without_an_rv(
    now: dict[int, int], share: float
) -> None:
    step, vehicle, lane = seen([{}, now])
    found = metrics.unregulated_ratios(step, lane, vehicle % 2 == 1, REGULATED, steps=3)
    assert list(found) == [1, pytest.approx(share), 1]


@given(places=PLACES)
def test_unregulated_lanes_agree_with_looking_at_each_lane(places: list[dict[int, int]]) -> None:
    step, vehicle, lane = seen(places)
    found = metrics.unregulated_ratios(step, lane, vehicle % 2 == 1, REGULATED, len(places))
    for ratio, now in zip(found, places, strict=True):
        led = {lane for vehicle, lane in now.items() if vehicle % 2 == 1}
        assert ratio == pytest.approx(mean([lane not in led for lane in (1, 2, 3)]))


@given(warm_up=st.floats(0, 12), step=st.sampled_from([0.1, 0.5, 1.0]))
def test_the_window_holds_the_steps_after_the_warm_up(warm_up: float, step: float) -> None:
    times = [round(step * number, 3) for number in range(1, 21)]
    start = metrics.window_start(times, warm_up)
    assert times[start:] == [time for time in times if time > warm_up]


@given(values=st.lists(st.floats(0, 1), max_size=60), step=st.sampled_from([0.5, 1.0, 3.0]))
def test_a_curve_holds_the_mean_of_every_ten_seconds(values: list[float], step: float) -> None:
    size = {0.5: 20, 1.0: 10, 3.0: 3}[step]
    bins = [values[first : first + size] for first in range(0, len(values), size)]
    assert metrics.curve(numbers(values), step) == pytest.approx(
        [mean(b) for b in bins], abs=5.1e-5
    )


def test_collisions_are_unique_pairs_and_those_with_an_rv_apart() -> None:
    pairs = [("a", "b"), ("a", "b"), ("b", "c"), ("c", "d")]
    assert metrics.collisions(pairs, {"a", "c"}) == (3, 3)
    assert metrics.collisions(pairs, {"d"}) == (3, 1)
    assert metrics.collisions([], {"a"}) == (0, 0)


def trip(
    depart: float | None, arrival: float | None, emissions: Emissions | None = None, **facts: Any
) -> Trip:
    settled = {"insertion_delay": 0.0, "duration": 0.0, "time_loss": 0.0, "distance": 1000.0}
    return Trip(id="v", depart=depart, arrival=arrival, emissions=emissions, **{**settled, **facts})


def test_trip_figures_count_who_was_there_in_the_window() -> None:
    early = trip(0, 90, Emissions(co2=999, nox=9, fuel=9), time_loss=99, duration=90)
    across = trip(50, 150, Emissions(300, 0, 0), time_loss=10, duration=100, distance=500)
    stuck = trip(120, None, Emissions(100, 50, 0), time_loss=40, duration=80, insertion_delay=4)
    unrecorded = trip(130, 140, time_loss=16, duration=10, distance=9000, insertion_delay=3)
    outside = trip(None, None, insertion_delay=20, distance=0)
    found = metrics.trip_metrics(
        [early, across, stuck, unrecorded, outside], 100, [("a", "b")], {"a"}, emergency_brakings=3
    )
    assert found.time_loss == (10 + 40 + 16) / 3
    assert found.travel_time == (100 + 10) / 2
    assert found.arrived == 2
    assert found.insertion_delay == (4 + 3 + 20) / 3
    assert found.never_inserted == 1
    assert (found.collisions, found.collisions_with_robot, found.emergency_brakings) == (1, 1, 3)
    assert (found.co2, found.fuel) == (pytest.approx(400 / 1.5), 0)
    assert found.nox == pytest.approx(50 / 1.5)


def test_without_recorded_emissions_there_is_no_figure_of_them() -> None:
    found = metrics.trip_metrics([trip(10, 20)], 0, [], set(), 0)
    assert (found.arrived, found.co2, found.nox, found.fuel) == (1, None, None, None)


def test_without_trips_there_are_no_trip_figures() -> None:
    found = metrics.trip_metrics([], 0, [], set(), 0)
    means = (found.time_loss, found.travel_time, found.insertion_delay)
    assert (*means, found.co2, found.nox, found.fuel) == (None,) * 6
    assert (found.arrived, found.never_inserted, found.collisions) == (0, 0, 0)

"""What a controller sees, and the tracker that follows vehicles from step to step."""

from collections import defaultdict
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest
from factories.traffic import CAR, CROSSROADS, crossing, crossroads, state, vehicle
from hypothesis import given
from hypothesis import strategies as st

from benchmark.control.state import TrafficState, Vehicle
from benchmark.sumo.junction import Inside, Junction, ZoneLane
from benchmark.sumo.simulation import Reading
from benchmark.world import metrics
from benchmark.world.tracking import Identity, Log, Tracker

# --- the state -------------------------------------------------------------------------------


def test_a_movement_counts_its_vehicles_its_queue_and_its_mean_waiting() -> None:
    found = state(
        vehicle("a", "N-C", waiting=6.0, speed=0.0),
        vehicle("b", "N-C", waiting=0.0, speed=0.1, is_robot=False),
        vehicle("c", "N-C", waiting=3.0, speed=0.09),
        vehicle("d", "E-R", waiting=2.0),
        crossing("N-C", 0),
        crossing("N-C", 9),
    ).movements
    cross, right, empty = found["N-C"], found["E-R"], found["W-L"]
    assert (cross.vehicles, cross.robots, cross.queue_length, cross.waiting) == (3, 2, 2, 3.0)
    assert [cell for cell, taken in enumerate(cross.occupancy) if taken] == [0, 9]
    assert (right.vehicles, right.waiting) == (1, 2.0)
    assert (empty.vehicles, empty.waiting, any(empty.occupancy)) == (0, 0.0, False)
    assert set(found) == set(CROSSROADS.movements)


VEHICLES = st.lists(
    st.builds(
        vehicle,
        name=st.just("v"),
        movement=st.sampled_from(sorted(CROSSROADS.movements)),
        is_robot=st.booleans(),
        distance=st.floats(0, 100),
        speed=st.sampled_from([0.0, 0.05, 0.1, 5.0]),
        waiting=st.floats(0, 100),
    ),
    max_size=20,
)


@given(vehicles=VEHICLES)
def test_the_state_of_movements_agrees_with_counting_one_by_one(vehicles: list[Vehicle]) -> None:
    found = state(*vehicles)
    for name, movement in found.movements.items():
        here = [one for one in vehicles if one.movement == name]
        assert movement.vehicles == len(here)
        assert movement.robots == len([one for one in here if one.is_robot])
        assert movement.queue_length == len([one for one in here if one.speed < 0.1])
        if here:
            assert movement.waiting == pytest.approx(sum(one.waiting for one in here) / len(here))
    regulated = {name: found.movements[name].waiting for name in CROSSROADS.regulated_movements}
    if found.longest_waiting is None:
        assert max(regulated.values()) == 0
    else:
        assert regulated[found.longest_waiting] == max(regulated.values()) > 0
    assert found.deciding == tuple(
        one for one in vehicles if one.is_robot and one.distance <= 30 and one.movement[-1] != "R"
    )
    assert set(found.unregulated_lanes) == {
        lane.id
        for lane in CROSSROADS.lanes.values()
        if lane.index > 0 and not any(one.is_robot and one.lane == lane.id for one in vehicles)
    }


def test_pressure_counts_vehicles_and_weighs_their_waiting() -> None:
    movements = state(vehicle(waiting=6.0), vehicle("hv", waiting=0.0, is_robot=False)).movements
    assert movements["N-C"].pressure(0.5) == 2 * (1 + 0.5 * 3.0)
    assert movements["N-C"].pressure(0.0) == 2
    assert movements["W-L"].pressure(0.5) == 0


@pytest.mark.parametrize(
    ("position", "cell"), [(0.0, 0), (1.99, 0), (2.0, 1), (19.99, 9), (20.0, 9), (21.0, 9)]
)
def test_a_way_has_ten_cells(position: float, cell: int) -> None:
    assert crossing("N-C")._replace(position=position, way_length=20.0).cell == cell


def test_longest_waiting_goes_by_the_mean_and_not_by_the_sum() -> None:
    queue = [vehicle(f"q{number}", "E-C", waiting=4.0) for number in range(5)]
    assert state(*queue, vehicle("one", "N-L", waiting=5.0)).longest_waiting == "N-L"
    assert state(*queue, vehicle("right", "N-R", waiting=99.0)).longest_waiting == "E-C"


def test_nobody_waits_longest_while_nobody_waits() -> None:
    assert state().longest_waiting is None
    assert state(vehicle(waiting=0.0)).longest_waiting is None


@pytest.mark.parametrize(
    ("facts", "decides"),
    [
        ({"distance": 30.0}, True),
        ({"distance": 30.1}, False),
        ({"is_robot": False}, False),
        ({"movement": "N-R"}, False),
        ({"movement": "W-L"}, True),
    ],
)
def test_rvs_of_a_regulated_movement_decide_in_the_decision_zone(
    facts: dict[str, Any], decides: bool
) -> None:
    one = vehicle(**facts)
    assert state(one).deciding == ((one,) if decides else ())


def test_an_rv_regulates_its_lane_only() -> None:
    found = state(
        vehicle("leads", "N-C", lane="northbound_1"),
        vehicle("human", "S-C", lane="southbound_1", is_robot=False),
        vehicle("right", "W-R", lane="westbound_0"),
        vehicle("upstream", "E-C", lane="eastbound.upstream_0"),
    ).unregulated_lanes
    assert set(CROSSROADS.regulated_lanes) - set(found) == {"northbound_1"}


def test_a_state_is_read_only() -> None:
    found: TrafficState = state(vehicle())
    with pytest.raises(FrozenInstanceError):
        found.time = 5.0  # type: ignore[misc]
    with pytest.raises(AttributeError):
        found.vehicles[0].speed = 5.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        found.movements["N-C"] = None  # type: ignore[index]


# --- the tracker -----------------------------------------------------------------------------

ZONE = {lane: ZoneLane(0.0, 60.0, lane[:-2]) for lane in CROSSROADS.lanes}
ZONE |= {f"northbound.upstream_{i}": ZoneLane(64.0, 100.0, "northbound") for i in range(2)}


def tracker(step: float = 1.0, asked: list[str] | None = None) -> Tracker:
    """A tracker of vehicles of which those whose names begin with rv are RVs."""
    junction = Junction(
        intersection=crossroads(step=step),
        links={},
        zone=ZONE,
        inside={
            ":in_0": Inside("N-L", "northbound_3", offset=0.0, length=20.0),
            ":in_1": Inside("N-L", "northbound_3", offset=8.0, length=20.0),
        },
        roads={},
    )

    def identify(name: str) -> Identity:
        if asked is not None:
            asked.append(name)
        return Identity(name, name.startswith("rv"), "N-L", CAR)

    return Tracker(junction, identify)


def follow(readings: list[list[Reading]], step: float = 1.0) -> Log:
    found = tracker(step)
    for number, reading in enumerate(readings, 1):
        found.update(number * step, reading, [], frozenset())
    return found.log


def rows(log: Log) -> list[tuple[float, str, str, float]]:
    """The log unfolded: time, vehicle, lane and waiting of each sight."""
    times = [time for time, here in zip(log.times, log.present, strict=True) for _ in range(here)]
    columns = zip(times, log.vehicle, log.lane, log.waiting, strict=True)
    return [(t, log.vehicles[v].id, log.lanes[lane], waited) for t, v, lane, waited in columns]


def on(lane: str, name: str = "hv", speed: float = 5.0) -> list[Reading]:
    return [(name, lane, 20.0, speed)]


def test_waiting_counts_the_seconds_that_a_vehicle_stands_in_the_zone() -> None:
    speeds = [5.0, 0.0, 0.09, 0.1, 3.0, 0.0]
    log = follow([on("northbound_1", speed=speed) for speed in speeds], step=0.5)
    assert list(log.waiting) == [0.0, 0.5, 1.0, 1.0, 1.0, 1.5]
    assert list(log.times) == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert list(log.present) == [1] * 6
    assert log.vehicles == [Identity("hv", False, "N-L", CAR)]


def test_standing_outside_the_zone_does_not_count() -> None:
    here = on("northbound_1", speed=0.0)
    log = follow([here, [], [], here])
    assert [waited for _, _, _, waited in rows(log)] == [1.0, 2.0]
    assert list(log.present) == [1, 0, 0, 1]


def test_the_log_says_who_was_where_step_by_step() -> None:
    both = on("northbound_1", "rv") + on("northbound.upstream_0", "hv", speed=0.0)
    assert rows(follow([both, [], both[1:]])) == [
        (1.0, "rv", "northbound_1", 0.0),
        (1.0, "hv", "northbound.upstream_0", 1.0),
        (3.0, "hv", "northbound.upstream_0", 2.0),
    ]


READINGS = st.lists(
    st.dictionaries(
        st.sampled_from(["a", "b", "rv"]),
        st.tuples(st.sampled_from(sorted(ZONE)), st.sampled_from([0.0, 0.05, 0.1, 4.0])),
    ),
    max_size=25,
)


@given(readings=READINGS, step=st.sampled_from([0.5, 1.0]))
def test_the_log_agrees_with_counting_one_by_one(
    readings: list[dict[str, tuple[str, float]]], step: float
) -> None:
    log = follow(
        [[(v, lane, 9.0, speed) for v, (lane, speed) in now.items()] for now in readings], step
    )
    stood: dict[str, float] = defaultdict(float)
    expected = []
    for number, now in enumerate(readings, 1):
        for name, (lane, speed) in now.items():
            stood[name] += step if speed < 0.1 else 0
            expected.append((number * step, name, lane, stood[name]))
    assert rows(log) == expected
    assert [one.id for one in log.vehicles] == list(stood)


def test_readings_become_what_controllers_see() -> None:
    asked: list[str] = []
    found = tracker(asked=asked)
    zone = [("rv", "northbound_3", 12.0, 0.0)]
    inside = [("hv", ":in_1", 3.0, 7.0)]
    found.update(1.0, zone, inside, frozenset())
    vehicles, crossings = found.update(2.0, zone, inside, frozenset({"rv"}))
    assert vehicles == (Vehicle("rv", True, "N-L", "northbound_3", 12.0, 0.0, 2.0, True, CAR),)
    assert crossings[0][:7] == ("hv", False, "N-L", "northbound_3", 8.0 + 3.0, 20.0, 7.0)
    assert crossings[0].cell == 5
    assert sorted(asked) == ["hv", "rv"]
    assert rows(found.log) == [(1.0, "rv", "northbound_3", 1.0), (2.0, "rv", "northbound_3", 2.0)]


def test_the_log_and_the_state_agree_on_unregulated_lanes() -> None:
    reading = on("northbound_1", "rv") + on("eastbound_2", "rv2") + on("southbound_1")
    found = tracker()
    vehicles, _ = found.update(1.0, reading, [], frozenset())
    lanes = TrafficState(CROSSROADS, 1.0, vehicles, ()).unregulated_lanes
    log, count = found.log, len(CROSSROADS.regulated_lanes)
    robots = np.array([log.vehicles[index].is_robot for index in log.vehicle])
    regulated = np.array([lane in CROSSROADS.regulated_lanes for lane in log.lanes])
    step = np.zeros(len(log.vehicle), dtype=np.int64)
    ratios = metrics.unregulated_ratios(step, np.array(log.lane), robots, regulated, steps=1)
    assert (
        list(ratios) == [pytest.approx(len(lanes) / count)] == [pytest.approx((count - 2) / count)]
    )

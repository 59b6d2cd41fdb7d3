"""What a controller sees, and the tracker that follows vehicles from step to step."""

from collections import defaultdict
from dataclasses import FrozenInstanceError
from typing import Any

import pytest
from conftest import CAR, CROSSROADS, crossing, state, vehicle
from hypothesis import given
from hypothesis import strategies as st

from benchmark.network import Inside, Junction, ZoneLane
from benchmark.simulation import InJunction, InZone
from benchmark.state import TrafficState, Vehicle
from benchmark.tracking import Identity, Tracker

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

ROBOTS = {"rv", "rv2"}
ZONE = {lane: ZoneLane(0.0, 60.0, lane[:-2]) for lane in CROSSROADS.lanes}
ZONE |= {f":bay_{index}": ZoneLane(60.0, 4.0, "northbound") for index in range(4)}
ZONE |= {f"northbound.upstream_{i}": ZoneLane(64.0, 100.0, "northbound") for i in range(2)}
JUNCTION = Junction(
    intersection=CROSSROADS,
    links={},
    zone=ZONE,
    inside={
        ":in_0": Inside("N-L", "northbound_3", offset=0.0, length=20.0),
        ":in_1": Inside("N-L", "northbound_3", offset=8.0, length=20.0),
    },
    roads={},
)


def tracker(step: float = 1.0) -> Tracker:
    return Tracker(JUNCTION, step, lambda name: Identity(name in ROBOTS, "N-C", CAR))


def follow(readings: list[list[InZone]], step: float = 1.0) -> Tracker:
    found = tracker(step)
    for number, reading in enumerate(readings, 1):
        found.update(number * step, reading, [], frozenset())
    return found


def on(lane: str, name: str = "hv", speed: float = 5.0) -> list[InZone]:
    return [InZone(name, lane, 20.0, speed)]


def test_waiting_counts_the_seconds_that_a_vehicle_stands_in_the_zone() -> None:
    speeds = [5.0, 0.0, 0.09, 0.1, 3.0, 0.0]
    log = follow([on("northbound_1", speed=speed) for speed in speeds], step=0.5).log
    assert log.waiting == [0.0, 0.5, 1.0, 1.0, 1.0, 1.5]
    assert log.times == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert log.step == [0, 1, 2, 3, 4, 5]
    assert (set(log.vehicle), set(log.movement)) == ({"hv"}, {"N-C"})


def test_standing_outside_the_zone_does_not_count() -> None:
    here = on("northbound_1", speed=0.0)
    assert follow([here, [], [], here]).log.waiting == [1.0, 2.0]


READINGS = st.lists(
    st.dictionaries(st.sampled_from("abc"), st.sampled_from([0.0, 0.05, 0.1, 4.0])), max_size=25
)


@given(readings=READINGS, step=st.sampled_from([0.5, 1.0]))
def test_waiting_agrees_with_counting_one_by_one(
    readings: list[dict[str, float]], step: float
) -> None:
    log = follow(
        [[InZone(v, "northbound_1", 9.0, speed) for v, speed in now.items()] for now in readings],
        step,
    ).log
    stood: dict[str, float] = defaultdict(float)
    expected = []
    for number, now in enumerate(readings):
        for name, speed in now.items():
            stood[name] += step if speed < 0.1 else 0
            expected.append((number, name, stood[name]))
    assert list(zip(log.step, log.vehicle, log.waiting, strict=True)) == expected
    leaves = [len(a.keys() - b.keys()) for a, b in zip([{}, *readings], readings, strict=False)]
    assert log.crossed == leaves


@pytest.mark.parametrize(
    ("lanes", "changes"),
    [
        (["northbound_1", "northbound_2", "northbound_1"], [0, 1, 1]),
        (["northbound_1", "northbound_1"], [0, 0]),
        (["northbound.upstream_0", "northbound.upstream_1"], [0, 1]),
        (["northbound.upstream_1", ":bay_2", "northbound_2"], [0, 0, 0]),
        (["northbound.upstream_1", "northbound_3"], [0, 0]),
    ],
)
def test_moving_over_is_a_lane_change_and_driving_on_is_not(
    lanes: list[str], changes: list[int]
) -> None:
    assert follow([on(lane) for lane in lanes]).log.lane_changes == changes


def test_a_vehicle_that_leaves_the_zone_has_crossed() -> None:
    both = on("northbound_1", "a") + on("northbound_2", "b")
    assert follow([both, both[:1], [], both]).log.crossed == [0, 1, 1, 0]


@pytest.mark.parametrize(
    ("reading", "led"),
    [
        ([], 0),
        (on("northbound_1", "hv"), 0),
        (on("northbound_1", "rv"), 1),
        (on("northbound_1", "rv") + on("northbound_1", "rv2"), 1),
        (on("northbound_1", "rv") + on("westbound_3", "rv2"), 2),
        (on("northbound_0", "rv"), 0),
        (on("northbound.upstream_0", "rv"), 0),
    ],
)
def test_the_share_of_unregulated_lanes_counts_left_and_cross_lanes_without_an_rv(
    reading: list[InZone], led: int
) -> None:
    assert follow([reading]).log.unregulated == [pytest.approx((12 - led) / 12)]


def test_the_log_and_the_state_agree_on_unregulated_lanes() -> None:
    reading = on("northbound_1", "rv") + on("eastbound_2", "rv2") + on("southbound_1")
    found = tracker()
    vehicles, _ = found.update(1.0, reading, [], frozenset())
    lanes = TrafficState(CROSSROADS, 1.0, vehicles, ()).unregulated_lanes
    assert found.log.unregulated == [len(lanes) / len(CROSSROADS.regulated_lanes)]


def test_readings_become_what_controllers_see() -> None:
    asked: list[str] = []

    def identify(name: str) -> Identity:
        asked.append(name)
        return Identity(name in ROBOTS, "N-L", CAR)

    found = Tracker(JUNCTION, 1.0, identify)
    zone = [InZone("rv", "northbound_3", 12.0, 0.0)]
    inside = [InJunction("hv", ":in_1", 3.0, 7.0)]
    found.update(1.0, zone, inside, frozenset())
    vehicles, crossings = found.update(2.0, zone, inside, frozenset({"rv"}))
    assert vehicles == (Vehicle("rv", True, "N-L", "northbound_3", 12.0, 0.0, 2.0, True, CAR),)
    assert crossings[0][:7] == ("hv", False, "N-L", "northbound_3", 8.0 + 3.0, 20.0, 7.0)
    assert crossings[0].cell == 5
    assert sorted(asked) == ["hv", "rv"]

"""What a controller sees: counted by movement, looked up by vehicle, and read-only."""

from dataclasses import FrozenInstanceError
from typing import Any

import pytest
from factories.traffic import CROSSROADS, crossing, state, vehicle
from hypothesis import given
from hypothesis import strategies as st

from benchmark.control.state import TrafficState, Vehicle


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

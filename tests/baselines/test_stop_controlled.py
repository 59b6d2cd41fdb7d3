"""Stop signs: who stops, who goes first, and how many get through."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from factories.routes import LIGHT, Trips, write_routes
from factories.scenarios import parsed, smoke

from benchmark.control.state import STATIONARY, TrafficState
from benchmark.records.record import Record
from benchmark.scenario.scenario import Scenario
from benchmark.study.episode import Episode, run_episode
from benchmark.sumo import demand, network
from benchmark.sumo.demand import Routes, Traveller
from benchmark.world.world import World

ONE_LANE = {
    f"approaches.{name}.lanes": "RCL"
    for name in ("northbound", "eastbound", "southbound", "westbound")
}
LONG = {"evaluation.duration": 900, "evaluation.warm_up": 300, "demand.0.end": 900}
PRIORITY = {"intersection.priority": ["northbound", "southbound"]}
LINE = 5.0  # m before the entrance; who stops there stops at the line


def seen_of(
    folder: Path, monkeypatch: pytest.MonkeyPatch, trips: Trips, scenario: Scenario
) -> list[TrafficState]:
    """What is seen of vehicles by hand under stop signs."""
    roads = network.build_network(scenario)
    path = write_routes(folder / "hand.rou.xml", scenario, roads, trips)
    movements = roads.junctions[LIGHT].intersection.movements
    ways = {name: (movement.approach, movement.exit) for name, movement in movements.items()}
    travellers = {name: Traveller(name, "car", at, ways[way]) for name, way, at in trips}
    monkeypatch.setattr(demand, "build_routes", lambda *_: Routes(path, "", travellers, ""))
    states = []
    with World(scenario, 0.0, 1, controller="test", stop_signs=True) as world:
        while not world.over:
            states.append(world.step()[LIGHT])
    return states


def entries(states: Sequence[TrafficState]) -> dict[str, float]:
    """When each vehicle is first seen inside [s]; in the order of entering."""
    entered: dict[str, float] = {}
    for state in states:
        for crossing in state.inside:
            entered.setdefault(crossing.id, state.time)
    return entered


def stopped(states: Sequence[TrafficState]) -> set[str]:
    """The vehicles that stood at the line."""
    return {
        vehicle.id
        for state in states
        for vehicle in state.vehicles
        if vehicle.distance < LINE and vehicle.speed < STATIONARY
    }


@pytest.mark.parametrize("trips", [[("a", "N-C", 1.0)], [("a", "E-L", 1.0)], [("a", "S-R", 1.0)]])
def test_where_all_stop_even_a_lone_vehicle_stops(
    trips: Trips, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    states = seen_of(tmp_path, monkeypatch, trips, parsed())
    assert stopped(states) == {"a"} == entries(states).keys()


@pytest.mark.parametrize("first", ["N-C", "E-C"])
def test_where_all_stop_who_came_first_goes_first(
    first: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    second = {"N-C": "E-C", "E-C": "N-C"}[first]
    trips = [("second", second, 4.0), ("first", first, 1.0)]
    states = seen_of(tmp_path, monkeypatch, trips, parsed())
    assert list(entries(states)) == ["first", "second"]
    assert stopped(states) == {"first", "second"}


def test_with_priority_only_the_others_stop_and_they_wait_for_a_gap(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trips = [("minor", "E-C", 0.0), *((f"major.{n}", "N-C", 1.0 + 2 * n) for n in range(6))]
    states = seen_of(tmp_path, monkeypatch, trips, parsed(PRIORITY))
    assert stopped(states) == {"minor"}
    assert list(entries(states))[-1] == "minor"


def test_the_same_vehicles_come_on_the_same_roads_as_under_every_controller() -> None:
    scenario = smoke("crossing")
    signs = run_episode(Episode(scenario, "stop-controlled", None, 1))
    lights = run_episode(Episode(scenario, "traffic-light", None, 1))
    assert (signs.rules, signs.arbitration, signs.rate) == ("stop signs", None, None)
    assert signs.routes_hash == lights.routes_hash
    assert signs.network_hash != lights.network_hash


def hourly(total: float, changes: dict[str, object]) -> Record:
    """An episode at a demand [veh/h] that is equal on all approaches."""
    scenario = parsed({**ONE_LANE, **LONG, **changes}).at_demand(total)
    record = run_episode(Episode(scenario, "stop-controlled", None, 1))
    assert record.status == "ok", record.reason
    return record


def test_four_lanes_that_all_stop_carry_what_the_highway_capacity_manual_says() -> None:
    """Between 9.6 s a vehicle and lane (HCM 2010, case 5) and 1900 veh/h (HCM 1985)."""
    record = hourly(3000, {})
    assert 4 * 3600 / 9.6 <= record.junctions[LIGHT].throughput <= 1900
    assert record.trips is not None
    assert record.trips.collisions == 0


def test_priority_moves_the_waiting_to_those_that_stop() -> None:
    waiting = hourly(1000, PRIORITY).junctions[LIGHT].waiting_by_movement
    assert waiting["N-C"].mean < 1 < waiting["E-C"].mean

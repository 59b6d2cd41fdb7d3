"""The door to libsumo, with SUMO behind it: traffic made by hand on a plain crossing."""

import os
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import libsumo
import pytest
from factories.routes import LIGHT, write_routes
from factories.scenarios import network_of, parsed, shipped

from benchmark.control.state import Body
from benchmark.plumbing.errors import NetworkError, UsageError
from benchmark.sumo import demand, network, signals
from benchmark.sumo.junction import Junction
from benchmark.sumo.simulation import Simulation

CROSSING = parsed({"approaches.northbound.lanes": "R C C L"})
WIDTH = 13  # links of the light


Start = Callable[..., Simulation]


@pytest.fixture
def start(tmp_path: Path) -> Start:
    """Makes a simulation of vehicles by hand under dark lights."""

    def make(*trips: tuple[str, str, float], step: float = 1.0) -> Simulation:
        roads = network.build_network(CROSSING)
        routes = write_routes(tmp_path / "hand.rou.xml", CROSSING, roads, trips)
        program = signals.program_file({}, roads)
        return Simulation(roads.path, routes, program, step=step, seed=1, window=False)

    return make


def junction() -> Junction:
    return network.build_network(CROSSING).junctions[LIGHT]


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    """Every test leaves the door closed."""
    yield
    assert Simulation._ending is None or not Simulation._ending.alive


def test_a_second_simulation_at_once_is_refused_and_the_first_goes_on(start: Start) -> None:
    first, second = start(("a", "N-C", 0)), start()
    with first:
        first.step()
        with pytest.raises(UsageError, match="one simulation per process"), second:
            pass
        assert first.step() == 2.0


def test_an_error_inside_closes_the_simulation(start: Start) -> None:
    with pytest.raises(ZeroDivisionError), start() as simulation:
        simulation.step() / 0
    with start() as simulation:
        assert simulation.step() == 1.0


def test_files_that_sumo_refuses_raise_its_words_and_close(start: Start, tmp_path: Path) -> None:
    roads = network.build_network(CROSSING)
    program = signals.program_file({}, roads)
    missing = tmp_path / "missing.rou.xml"
    broken = Simulation(roads.path, missing, program, step=1, seed=1, window=False)
    with pytest.raises(NetworkError, match=r"SUMO does not start: .*missing.rou.xml"), broken:
        pass
    with start() as simulation:
        assert simulation.step() == 1.0


def test_nothing_is_left_in_the_temporary_folder(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with start(("a", "N-C", 0)) as simulation:
        simulation.step()
        assert list(tmp_path.glob("rightofway-*"))
        simulation.finish()
    assert not list(tmp_path.glob("rightofway-*"))


def test_sumo_home_of_another_installation_is_not_used(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SUMO_HOME", "/opt/other-sumo")
    with start() as simulation:
        simulation.step()
        assert (Path(os.environ["SUMO_HOME"]) / "bin" / "sumo").exists()


def test_time_goes_by_steps(start: Start) -> None:
    with start(step=0.5) as simulation:
        assert [simulation.step() for _ in range(3)] == [0.5, 1.0, 1.5]


def test_a_vehicle_is_followed_through_the_zone_and_the_intersection(start: Start) -> None:
    with start(("a", "N-L", 0)) as simulation:
        zone, inside = [], []
        for _ in range(30):
            simulation.step()
            zone += simulation.in_zone(junction())
            inside += simulation.inside(junction())
    assert {(name, lane) for name, lane, _, _ in zone} == {("a", "northbound_3")}
    distances = [distance for _, _, distance, _ in zone]
    assert all(near < far for far, near in pairwise(distances))
    assert distances[0] > 80
    assert 0 <= distances[-1] < 10.01
    inside_lanes = junction().inside
    (movement,) = {inside_lanes[lane].movement for _, lane, _, _ in inside}
    positions = [inside_lanes[lane].offset + at for _, lane, at, _ in inside]
    assert movement == "N-L"
    assert positions == sorted(positions)
    assert all(speed <= 10.01 for *_, speed in zone + inside)  # the scenario's speed cap


def test_the_zone_reaches_upstream_of_the_turn_bay() -> None:
    name = "smoke/asymmetric"
    roads, scenario = network_of(name), shipped(name)
    routes = demand.build_routes(scenario, roads, seed=1)
    program = signals.program_file({}, roads)
    seen: dict[str, list[float]] = {}
    with Simulation(roads.path, routes.path, program, step=1, seed=1, window=False) as simulation:
        for _ in range(60):
            simulation.step()
            for _, lane, distance, _ in simulation.in_zone(roads.junctions[LIGHT]):
                seen.setdefault(lane, []).append(distance)
    upstream = [one for lane, many in seen.items() if ".upstream" in lane for one in many]
    assert upstream
    assert all(60 <= distance <= 80 for distance in upstream)
    assert all(0 <= distance <= 80 for many in seen.values() for distance in many)


def test_a_body_is_what_the_class_says(start: Start) -> None:
    with start(("a", "N-C", 0)) as simulation:
        simulation.step()
        assert simulation.body("a") == Body("car", 5.0, 2.6, 4.5, maximum_speed=10.0)


def test_a_vehicle_keeps_the_speed_it_was_asked_for_until_it_is_released(start: Start) -> None:
    with start(("a", "N-C", 0)) as simulation:
        simulation.step()
        simulation.set_speed("a", 0.0)
        for _ in range(5):
            simulation.step()
        ((*_, standing),) = simulation.in_zone(junction())
        for _ in range(400):  # SUMO would teleport it after 300 s
            simulation.step()
        ((*_, after_a_jam),) = simulation.in_zone(junction())
        simulation.release("a")
        for _ in range(5):
            simulation.step()
        ((*_, released),) = simulation.in_zone(junction())
    assert standing == after_a_jam == 0.0
    assert released > 5


def test_releasing_a_vehicle_that_has_arrived_is_passed_over(start: Start) -> None:
    with start(("a", "N-C", 0)) as simulation:
        for _ in range(60):
            simulation.step()
        simulation.release("a")
        (trip,) = simulation.finish()
    assert trip.arrival is not None


def test_a_speed_is_only_asked_for_and_safety_stays_on(start: Start) -> None:
    with start(("leader", "E-C", 0), ("rv", "E-C", 3)) as simulation:
        crashes, gaps = [], []
        for time in range(1, 41):
            simulation.step()
            if time == 7:
                simulation.set_speed("leader", 0.0)
            crashes += simulation.colliding()
            distances = {name: distance for name, _, distance, _ in simulation.in_zone(junction())}
            if time >= 7:
                simulation.set_speed("rv", 50.0)
                gaps.append(distances["rv"] - distances["leader"] - 5.0)
        assert simulation.emergency_brakings() == 0
    assert not crashes
    assert 0 < min(gaps) < 5  # it drove up close and stopped behind


def test_red_holds_even_a_vehicle_that_is_asked_to_go(start: Start) -> None:
    with start(("rv", "N-C", 0)) as simulation:
        simulation.step()
        simulation.set_lights(LIGHT, "r" * WIDTH)
        for _ in range(30):
            simulation.step()
            simulation.set_speed("rv", 10.0)
        ((_, _, distance, speed),) = simulation.in_zone(junction())
        assert (speed, distance < 5) == (0.0, True)
        simulation.set_lights(LIGHT, "G" * WIDTH)
        for _ in range(5):
            simulation.step()
        assert not simulation.in_zone(junction())


def test_a_lane_change_takes_a_step_where_there_is_room(start: Start) -> None:
    with start(("a", "N-C", 0)) as simulation:
        simulation.step()
        ((_, before, _, _),) = simulation.in_zone(junction())
        other = {"northbound_1": 2, "northbound_2": 1}[before]
        simulation.change_lane("a", other)
        simulation.step()
        ((_, after, _, _),) = simulation.in_zone(junction())
    assert after == f"northbound_{other}"


def test_colliding_pairs_are_sorted_and_repeat_while_nobody_is_moved_away(start: Start) -> None:
    with start(("a", "E-C", 0), ("b", "E-C", 3)) as simulation:
        pairs = []
        for time in range(1, 41):
            simulation.step()
            if time == 3:
                simulation.set_speed("a", 0.0)
            if time >= 4:
                libsumo.vehicle.setSpeedMode("b", 32)  # unsafe, which only a test can ask for
                libsumo.vehicle.setSpeed("b", 3.0 if time < 25 else 0.0)
            pairs.append(simulation.colliding())
            if pairs[-1]:
                libsumo.vehicle.setSpeed("b", 0.0)
        assert len(simulation.in_zone(junction())) == 2
    crashes = [one for one in pairs if one]
    assert len(crashes) > 5
    assert all(one == [("a", "b")] for one in crashes)


def test_emergency_brakings_are_counted_from_the_start(start: Start) -> None:
    with start(("a", "N-L", 5), ("b", "E-C", 5)) as simulation:
        counts = []
        for _ in range(40):
            simulation.step()
            counts.append(simulation.emergency_brakings())
    assert (counts[0], counts[-1]) == (0, 1)
    assert counts == sorted(counts)


def test_trips_tell_arrived_from_under_way_from_never_inserted(start: Start) -> None:
    jam = [(f"jam.{number:02}", "E-C", 20.0) for number in range(20)]
    with start(("free", "N-C", 0), *jam) as simulation:
        for time in range(1, 61):
            simulation.step()
            if time == 21:
                simulation.set_speed("jam.00", 0.0)
        on_road = {name for name, *_ in simulation.in_zone(junction())}
        trips = {trip.id: trip for trip in simulation.finish()}
    assert set(trips) == {"free", *(name for name, *_ in jam)}
    free = trips["free"]
    assert (free.depart, free.insertion_delay) == (0.0, 0.0)
    assert free.arrival == free.duration
    assert free.time_loss < 3
    assert free.distance > 200
    assert {name for name, trip in trips.items() if trip.depart is None} == set(trips) - on_road - {
        "free"
    }
    for name in set(trips) - {"free"}:
        trip = trips[name]
        assert trip.arrival is None
        wanted = 40 if trip.depart is None else trip.depart - 20
        assert trip.insertion_delay == pytest.approx(wanted, abs=1)
    assert 0 < sum(trip.depart is None for trip in trips.values()) < 20


def test_the_same_tenth_of_the_vehicles_reports_emissions_in_every_run(start: Start) -> None:
    def run() -> list[str]:
        crowd = [(f"v{number:02}", "N-C", 4.0 * number) for number in range(30)]
        with start(*crowd) as simulation:
            for _ in range(180):
                simulation.step()
            trips = simulation.finish()
        for one in (trip.emissions for trip in trips if trip.emissions):
            assert min(one.co2, one.nox, one.fuel) > 0
        return [trip.id for trip in trips if trip.emissions]

    first = run()
    numbers = [int(name[1:]) for name in first]
    assert numbers == list(range(numbers[0], 30, 10))
    assert run() == first


def test_a_simulation_that_nobody_refers_to_any_more_ends_itself(start: Start) -> None:
    dropped = start(("a", "N-C", 0)).__enter__()
    folder = Path(dropped._folder.name)
    round_trip: list[object] = [dropped]
    round_trip.append(round_trip)  # only the garbage collector finds it
    del dropped, round_trip
    with start() as simulation:
        assert simulation.step() == 1.0
    assert not folder.exists()


def test_finished_frames_of_an_exception_in_hand_keep_no_simulation(start: Start) -> None:
    def fail() -> None:
        simulation = start().__enter__()
        raise ZeroDivisionError(simulation.step())

    try:
        fail()
    except ZeroDivisionError:
        with start() as simulation:
            assert simulation.step() == 1.0


def test_a_refusal_says_who_holds_the_simulation(start: Start) -> None:
    first, second = start(), start()
    first.owner = "training on 334 at seed 10001"
    with first, pytest.raises(UsageError, match="training on 334 at seed 10001 holds it"), second:
        pass

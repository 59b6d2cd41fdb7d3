"""Whole episodes whose answer is known: few vehicles by hand, real SUMO, a script that steers."""

from collections.abc import Callable, Mapping
from itertools import combinations, groupby, pairwise
from pathlib import Path
from typing import Any

import libsumo
import pytest
from factories.routes import LIGHT, Trips, write_routes
from factories.scenarios import parsed, smoke

from benchmark.control import plugins
from benchmark.control.controller import Command, Controller, Drive, Go, Phase, Stop
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle
from benchmark.records.record import JunctionMetrics, Record
from benchmark.scenario.scenario import Scenario
from benchmark.study.episode import Episode, run_episode
from benchmark.sumo import demand, network
from benchmark.sumo.demand import Routes, Traveller

CROSSING = parsed({"evaluation.duration": 90})
Script = Callable[[TrafficState], Mapping[str, Command]]
Play = Callable[..., tuple[Record, list[TrafficState]]]


class Scripted(Controller):
    """Does what a test says and keeps what it saw."""

    script: Script
    seen: list[TrafficState]

    def reset(self, intersection: Intersection, seed: int) -> None:
        self.seen.clear()

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        self.seen.append(state)
        return type(self).script(state)


def idle(state: TrafficState) -> Mapping[str, Command]:
    return {}


def stop(state: TrafficState) -> Mapping[str, Command]:
    return {vehicle.id: Stop() for vehicle in state.deciding}


def go(state: TrafficState) -> Mapping[str, Command]:
    return {vehicle.id: Go() for vehicle in state.deciding}


@pytest.fixture
def play(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Play:
    """Runs an episode of a script, or of an installed controller, with vehicles by hand."""

    def play(
        script: Script | str,
        trips: Trips | None = None,
        scenario: Scenario = CROSSING,
        rate: float = 1.0,
        **contract: Any,
    ) -> tuple[Record, list[TrafficState]]:
        kind = type("Kind", (Scripted,), {"script": staticmethod(script), "seen": [], **contract})
        name = script if isinstance(script, str) else "scripted"
        with monkeypatch.context() as patch:
            if not isinstance(script, str):
                patch.setattr(plugins, "load_class", lambda name: kind)
                patch.setattr(plugins, "provenance", lambda name: "tests")
            if trips is not None:
                roads = network.build_network(scenario)
                path = write_routes(tmp_path / "hand.rou.xml", scenario, roads, trips)
                movements = roads.junctions[LIGHT].intersection.movements
                ways = {m: (one.approach, one.exit) for m, one in movements.items()}
                travellers = {v: Traveller(v, "car", at, ways[m]) for v, m, at in trips}
                patch.setattr(demand, "build_routes", lambda *_: Routes(path, "", travellers, ""))
            record = run_episode(Episode(scenario, name, rate, seed=1))
        assert record.status == "ok", record.reason
        return record, kind.seen

    return play


def figures(record: Record) -> JunctionMetrics:
    return record.junctions[LIGHT]


def longest_waiting(record: Record) -> float:
    waiting = figures(record).waiting_time_per_vehicle
    assert waiting is not None
    return waiting.maximum


def by_id(state: TrafficState) -> dict[str, Vehicle]:
    return {vehicle.id: vehicle for vehicle in state.vehicles}


def stream(movement: str, size: int, start: float = 0.0) -> list[tuple[str, str, float]]:
    """Vehicles of one movement, three seconds apart."""
    return [(f"{movement}.{number:02}", movement, start + 3 * number) for number in range(size)]


@pytest.mark.parametrize("movement", ["N-C", "E-L", "S-R"])
def test_a_lone_vehicle_under_dark_lights_waits_for_nothing(play: Play, movement: str) -> None:
    record, _ = play("unsignalised", [("lone", movement, 1.0)])
    seen, trips = figures(record), record.trips
    assert trips is not None
    assert (seen.average_waiting_time, seen.wang_waiting_time, longest_waiting(record)) == (0, 0, 0)
    assert seen.throughput == 3600 / 90
    assert (trips.arrived, trips.insertion_delay, trips.never_inserted) == (1, 0, 0)
    assert (trips.collisions, trips.emergency_brakings) == (0, 0)
    assert trips.time_loss is not None
    assert trips.time_loss < 6


@pytest.mark.parametrize(
    "pair",
    [
        *("N-C S-C", "E-C W-C", "N-L S-L", "E-L W-L"),
        *("N-C N-L", "E-C E-L", "S-C S-L", "W-C W-L"),
    ],
)
def test_conflict_free_movements_never_hold_each_other_back(play: Play, pair: str) -> None:
    one, other = pair.split()
    record, seen = play(go, [*stream(one, 6), *stream(other, 6)])
    assert figures(record).go_held_back == 0
    assert not any(vehicle.held_back for state in seen for vehicle in state.vehicles)
    assert longest_waiting(record) == 0
    assert record.trips is not None
    assert record.trips.arrived == 12


def test_conflicting_movements_hold_each_other_back_until_the_intersection_is_clear(
    play: Play,
) -> None:
    trips = [*stream("N-C", 6), *stream("E-C", 6)]
    record, seen = play(go, trips)
    assert figures(record).go_held_back > 0
    assert {v.id[:3] for state in seen for v in state.vehicles if v.held_back} <= {"N-C", "E-C"}
    assert any(v.held_back for state in seen for v in state.vehicles)
    assert record.trips is not None
    assert (record.trips.arrived, record.trips.collisions) == (12, 0)
    own, _ = play(go, trips, arbitration="own")
    assert figures(own).go_held_back == 0


def test_a_stopped_rv_halts_before_the_entrance_and_holds_its_lane(play: Play) -> None:
    robot = next(name for name in map(str, range(99)) if demand.is_robot(1, name, 0.3))
    humans = [n for n in map(str, range(100, 199)) if not demand.is_robot(1, n, 0.3)][:4]
    trips = [(name, "N-C", 4.0 * place) for place, name in enumerate([robot, *humans])]
    record, seen = play(stop, trips, rate=0.3)
    queue = sorted(seen[-1].vehicles, key=lambda vehicle: vehicle.distance)
    assert [vehicle.id for vehicle in queue] == [robot, *humans]
    assert [vehicle.is_robot for vehicle in queue] == [True, False, False, False, False]
    assert 1 <= queue[0].distance <= 3
    assert all(vehicle.speed == 0 for vehicle in queue)
    assert all(7 < back.distance - front.distance < 10 for front, back in pairwise(queue))
    assert not any(state.inside for state in seen)
    assert figures(record).throughput == 0
    halted = next(state.time for state in seen if any(v.speed < 0.1 for v in state.vehicles))
    assert longest_waiting(record) == 90 - halted + 1  # a step counts where it ends


def test_go_from_standstill_enters(play: Play) -> None:
    record, seen = play(lambda state: (stop if state.time < 40 else go)(state), [("rv", "N-C", 0)])
    assert by_id(seen[38])["rv"].speed == 0
    entered = next(state.time for state in seen if state.inside)
    assert 40 < entered <= 43
    assert record.trips is not None
    assert record.trips.arrived == 1


def full_throttle(state: TrafficState) -> Mapping[str, Command]:
    return {vehicle.id: Drive(vehicle.body.acceleration) for vehicle in state.vehicles}


def test_drive_reaches_the_entrance_but_enters_only_under_a_controllers_own_arbitration(
    play: Play,
) -> None:
    _, seen = play(full_throttle, [("rv", "N-C", 0)])
    (vehicle,) = seen[-1].vehicles
    assert (0 < vehicle.distance < 3, vehicle.speed) == (True, 0)
    record, _ = play(full_throttle, [("rv", "N-C", 0)], arbitration="own")
    assert record.trips is not None
    assert (record.trips.arrived, longest_waiting(record)) == (1, 0)


def test_creeping_hides_from_waiting_but_not_from_time_loss(play: Play) -> None:
    def creep(state: TrafficState) -> Mapping[str, Command]:
        wanted = {v.id: max(-v.body.deceleration, 0.2 - v.speed) for v in state.vehicles}
        return {name: Drive(acceleration) for name, acceleration in wanted.items()}

    record, _ = play(creep, [("rv", "N-C", 0)])
    assert longest_waiting(record) == 0
    assert record.trips is not None
    assert record.trips.time_loss is not None
    assert record.trips.time_loss > 70


def test_red_holds_a_vehicle_and_its_waiting_is_the_rest_of_the_red(play: Play) -> None:
    # greens: lefts N S 0-10, crosses N S 15-35, lefts E W 40-50, crosses E W 55-75 s
    trips = [("E-C", "E-C", 0.0), ("N-L", "N-L", 6.0)]
    record, seen = play(idle, trips, rules="signals")
    waiting = figures(record).waiting_by_movement
    for name, green in (("E-C", 55), ("N-L", 80)):
        standing = [
            state.time for state in seen for v in state.vehicles if v.id == name and v.speed < 0.1
        ]
        assert 10 < standing[0] < 25
        assert standing[-1] == pytest.approx(green, abs=2)
        assert waiting[name].maximum == len(standing) == standing[-1] - standing[0] + 1
    same, _ = play("traffic-light", trips, rate=0.0)
    assert figures(same).waiting_by_movement == waiting


def test_a_phase_command_gets_yellow_and_all_red_first(play: Play) -> None:
    lights: list[str] = []

    def change(state: TrafficState) -> Mapping[str, Command]:
        lights.append(libsumo.trafficlight.getRedYellowGreenState(LIGHT))
        return {LIGHT: Phase("N-C S-C" if state.time < 21 else "E-C W-C")}

    _, seen = play(change, [], rules="signals")

    def course(movement: str) -> list[tuple[str, int]]:
        links = network.build_network(CROSSING).junctions[LIGHT].links
        (place,) = (index for index, name in links.items() if name == movement)
        shown = (state[place] for state in lights[1:])  # the first is the program's own
        return [(letter, len(list(run))) for letter, run in groupby(shown)]

    assert course("N-C") == course("S-C") == [("G", 20), ("y", 4), ("r", 65)]
    assert course("E-C") == course("W-C") == [("r", 25), ("G", 64)]
    phases = [(name, len(list(run))) for name, run in groupby(state.phase for state in seen)]
    assert phases == [(None, 1), ("N-C S-C", 20), (None, 5), ("E-C W-C", 64)]


def test_without_rules_a_busy_crossing_jams_where_the_signal_lets_it_flow(play: Play) -> None:
    busy = {"left": 200, "cross": 700, "right": 100}
    counts = {f"demand.0.{a}": busy for a in ("northbound", "eastbound", "southbound", "westbound")}
    length = {"evaluation.duration": 400, "evaluation.warm_up": 200, "demand.0.end": 400}
    scenario = parsed(counts | length)
    nobody, _ = play("unsignalised", scenario=scenario, rate=0.0)
    signal, _ = play("traffic-light", scenario=scenario, rate=0.0)
    assert nobody.trips is not None
    assert signal.trips is not None
    assert figures(nobody).throughput < 0.5 * figures(signal).throughput
    assert figures(nobody).average_waiting_time > 2 * figures(signal).average_waiting_time
    assert nobody.trips.never_inserted > signal.trips.never_inserted


def test_more_rvs_are_a_superset_of_fewer_and_idle_ones_change_nothing(play: Play) -> None:
    robots, records = [], []
    for rate in (0.0, 0.3, 0.6, 1.0):
        record, seen = play(idle, scenario=smoke("tee"), rate=rate)
        robots.append({v.id for state in seen for v in state.vehicles if v.is_robot})
        records.append(record.trips)
        everyone = {v.id for state in seen for v in state.vehicles}
    assert robots[0] == set()
    assert robots[-1] == everyone
    assert all(few < many for few, many in pairwise(robots))
    assert all(one == other for one, other in combinations(records, 2))


def test_a_jammed_entrance_counts_those_who_wait_to_enter(play: Play) -> None:
    record, seen = play(stop, stream("N-C", 25))
    entered = {vehicle.id for state in seen for vehicle in state.vehicles}
    assert record.trips is not None
    assert 10 < len(entered) < 20  # 100 m of lane for bodies of 5 m with gaps of 2.5 m
    assert record.trips.never_inserted == 25 - len(entered)
    late = [90 - 3.0 * number for number in range(len(entered), 25)]
    assert record.trips.insertion_delay == pytest.approx(sum(late) / 25, rel=0.25)
    assert record.trips.insertion_delay > 10


def test_collisions_count_each_pair_once_and_those_with_an_rv_apart(play: Play) -> None:
    names = [str(number) for number in range(99)]
    robot = next(name for name in names if demand.is_robot(1, name, 0.3))
    a, b, c = [name for name in names if not demand.is_robot(1, name, 0.3)][:3]
    trips = [(a, "E-C", 0.0), (b, "E-C", 3.0), (c, "N-C", 0.0), (robot, "N-C", 3.0)]

    def crash(state: TrafficState) -> Mapping[str, Command]:
        for front, back in ((a, b), (c, robot)):
            if state.time == 3:
                libsumo.vehicle.setSpeed(front, 0.0)
            if state.time == 5:
                libsumo.vehicle.setSpeedMode(back, 32)  # unsafe, which only a test can ask for
                libsumo.vehicle.setSpeed(back, 1.0)
        return {}

    record, _ = play(crash, trips, rate=0.3)
    assert record.trips is not None
    assert (record.trips.collisions, record.trips.collisions_with_robot) == (2, 1)

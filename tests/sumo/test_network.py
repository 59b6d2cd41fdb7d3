"""Networks: movements, conflicts, lanes and lengths as the scenario says, the same every time."""

import re
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
import sumolib
from factories.scenarios import DROP, PAPER, SHIPPED, network_of, parsed, shipped
from factories.traffic import CONFLICT_FREE

from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.layout import COMPASS, LETTERS
from benchmark.scenario.scenario import CENTRE, Scenario
from benchmark.study.episode import Episode, run_episode
from benchmark.sumo import network
from benchmark.sumo.junction import Junction, movement_of
from benchmark.sumo.signals import check_programs

NORTH = "approaches.northbound"


def junction_of(name: str) -> Junction:
    (junction,) = network_of(name).junctions.values()
    return junction


@pytest.mark.parametrize("name", PAPER)
def test_an_intersection_of_the_paper_has_its_conflict_free_set(name: str) -> None:
    intersection = junction_of(name).intersection
    movements = intersection.regulated_movements
    free = {
        frozenset(pair) for pair in combinations(movements, 2) if not intersection.conflict(*pair)
    }
    assert movements == ("N-L", "N-C", "E-L", "E-C", "S-L", "S-C", "W-L", "W-C")
    assert free == CONFLICT_FREE


@pytest.mark.parametrize("name", SHIPPED)
def test_conflicts_are_mutual_and_never_with_ones_own_approach_or_a_right_turn(name: str) -> None:
    movements = junction_of(name).intersection.movements
    assert any(movement.conflicts for movement in movements.values())
    for movement in movements.values():
        for other in (movements[one] for one in movement.conflicts):
            assert movement.id in other.conflicts
            assert movement.approach != other.approach
            assert movement.regulated
            assert other.regulated


@pytest.mark.parametrize("name", SHIPPED)
def test_roads_have_the_asked_lengths_up_to_the_entrance(name: str) -> None:
    intersection = junction_of(name).intersection
    roads = sumolib.net.readNet(str(network_of(name).path), withInternal=True)
    for approach, asked in shipped(name).approaches.items():
        length = roads.getEdge(approach).getLength()
        lanes = [lane for lane in intersection.lanes.values() if lane.approach == approach]
        assert length == pytest.approx(asked.bay or asked.length, abs=0.1)
        assert {lane.length for lane in lanes} == {length}
        if asked.has_bay:
            upstream = roads.getEdge(f"{approach}.upstream")
            node = 4.0  # m that netconvert cuts out where the lanes spread
            assert upstream.getLength() + node + length == pytest.approx(asked.length, abs=0.1)
            assert len(upstream.getLanes()) == asked.upstream_lanes


@pytest.mark.parametrize("name", SHIPPED)
def test_lanes_serve_the_movements_that_the_scenario_gives_them(name: str) -> None:
    lanes = junction_of(name).intersection.lanes
    for approach, asked in shipped(name).approaches.items():
        served = {
            lane.index: set(lane.movements) for lane in lanes.values() if lane.approach == approach
        }
        assert served == {
            index: {f"{LETTERS[approach]}-{turn}" for turn in turns}
            for index, turns in enumerate(asked.lane_turns)
        }


@pytest.mark.parametrize("name", SHIPPED)
def test_every_link_and_every_piece_of_road_inside_belongs_to_a_movement(name: str) -> None:
    junction = junction_of(name)
    movements = junction.intersection.movements
    roads = sumolib.net.readNet(str(network_of(name).path), withInternal=True)
    assert sorted(junction.links) == list(range(len(junction.links)))
    assert set(junction.links.values()) == set(movements) == set(junction.roads.values())
    for movement in movements.values():
        assert {way.lane for way in movement.ways} == {
            lane.id
            for lane in junction.intersection.lanes.values()
            if movement.id in lane.movements
        }
        for way in movement.ways:
            end = 0.0
            for lane, piece in junction.inside.items():
                if (piece.movement, piece.lane) == (movement.id, way.lane):
                    assert (piece.offset, piece.length) == (end, way.length)
                    end += roads.getLane(lane).getLength()
            assert end == pytest.approx(way.length)


@pytest.mark.parametrize("name", SHIPPED)
def test_right_turns_keep_to_the_kerb_and_the_others_to_the_centre_of_the_exit(name: str) -> None:
    roads = sumolib.net.readNet(str(network_of(name).path))
    for movement in junction_of(name).intersection.movements.values():
        lanes = range(len(roads.getEdge(movement.exit).getLanes()))
        taken = sorted(roads.getLane(way.exit_lane).getIndex() for way in movement.ways)
        count = len(movement.ways)
        assert taken == list(lanes[:count] if movement.turn == "R" else lanes[-count:])


@pytest.mark.parametrize(
    "scenario",
    [*map(shipped, SHIPPED), parsed({f"{NORTH}.bay": 50, f"{NORTH}.upstream_lanes": 5})],
    ids=[*SHIPPED, "five lanes into three"],
)
def test_no_lane_ends_before_the_entrance_and_every_bay_can_be_reached(scenario: Scenario) -> None:
    roads = sumolib.net.readNet(str(network.build_network(scenario).path))
    for approach, asked in scenario.approaches.items():
        if asked.has_bay:
            upstream, bay = roads.getEdge(f"{approach}.upstream"), roads.getEdge(approach)
            (links,) = upstream.getOutgoing().values()
            assert {link.getFromLane() for link in links} == set(upstream.getLanes())
            assert {link.getToLane() for link in links} == set(bay.getLanes())


def test_a_t_junction_has_exactly_the_movements_that_lead_somewhere() -> None:
    intersection = junction_of("smoke/tee").intersection
    assert set(intersection.movements) == {"N-L", "N-R", "E-C", "E-R", "W-L", "W-C"}
    assert intersection.regulated_movements == ("N-L", "E-C", "W-L", "W-C")
    assert intersection.movements["N-L"].conflicts == {"E-C", "W-L", "W-C"}
    assert not intersection.conflict("E-C", "W-C")


@pytest.mark.parametrize("name", SHIPPED)
def test_the_control_zone_reaches_upstream_of_a_short_bay(name: str) -> None:
    junction, reach = junction_of(name), shipped(name).intersection.control_zone
    for approach, asked in shipped(name).approaches.items():
        zone = {lane: place for lane, place in junction.zone.items() if place.approach == approach}
        upstream = {lane: z for lane, z in zone.items() if lane.startswith(f"{approach}.upstream")}
        assert max(place.end + place.length for place in zone.values()) >= min(reach, asked.length)
        assert bool(upstream) == (asked.has_bay and asked.bay is not None and asked.bay < reach)
        for place in upstream.values():
            between = [one for lane, one in zone.items() if lane.startswith(":")]
            assert [one.end for one in between] == pytest.approx(
                [asked.bay] * len(between), abs=0.1
            )
            assert {one.end + one.length for one in between} == {place.end}


def test_the_facts_of_an_intersection_are_the_scenarios() -> None:
    intersection = junction_of("smoke/tee").intersection
    assert (intersection.control_zone, intersection.decision_zone, intersection.step) == (80, 30, 1)
    assert intersection.phases == {
        "E-C W-C": {"E-C", "W-C"},
        "W-C W-L": {"W-C", "W-L"},
        "N-L": {"N-L"},
    }


@pytest.mark.parametrize("name", ["smoke/asymmetric", PAPER[0]])
def test_a_scenario_builds_the_same_network_in_a_fresh_cache(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = network_of(name)
    monkeypatch.setattr(network, "_built", {})
    again = network.build_network(shipped(name))
    monkeypatch.setattr(network, "_built", {})
    monkeypatch.setenv("RIGHTOFWAY_CACHE", str(tmp_path))
    fresh = network.build_network(shipped(name))
    assert again == before
    assert tmp_path in fresh.path.parents
    assert (fresh.hash, fresh.junctions) == (before.hash, before.junctions)


@pytest.mark.parametrize("name", SHIPPED)
def test_stop_signs_stand_on_the_same_roads(name: str) -> None:
    lit, signed = network_of(name), network.build_network(shipped(name), stop_signs=True)
    (with_lights,), (with_signs,) = lit.intersections, signed.intersections
    assert with_signs.lanes == with_lights.lanes
    for movement, other in zip(
        with_signs.movements.values(), with_lights.movements.values(), strict=True
    ):
        assert (movement.id, movement.conflicts) == (other.id, other.conflicts)
        ends = [(way.lane, way.exit_lane, way.shape[0], way.shape[-1]) for way in movement.ways]
        assert ends == [
            (way.lane, way.exit_lane, way.shape[0], way.shape[-1]) for way in other.ways
        ]
    assert lit.hash != signed.hash


def test_another_scenario_builds_another_network() -> None:
    assert len({network_of(name).hash for name in SHIPPED}) == len(SHIPPED)


BACK = {
    "approaches.northbound.lanes": "R C LU",
    "demand.0.northbound": {"left": 100, "cross": 200, "right": 50, "u_turn": 200},
    "signal.phases.0": {"movements": ["N-L", "N-U", "S-L"], "green": 10},
}


def test_a_u_turn_leaves_on_its_own_leg_and_conflicts_with_who_comes_there() -> None:
    (intersection,) = network.build_network(parsed(BACK)).intersections
    back = intersection.movements["N-U"]
    assert (back.turn, back.exit, back.regulated) == ("U", "southbound.exit", True)
    assert back.conflicts == {"S-C", "W-L"}
    assert set(intersection.movements) == {f"{a}-{t}" for a in "NESW" for t in "LCR"} | {"N-U"}


@pytest.mark.parametrize(
    ("controller", "rate"),
    [("traffic-light", None), ("stop-controlled", None), ("first-come", 0.5), ("wang", 0.5)],
)
def test_u_turns_are_driven(controller: str, rate: float | None) -> None:
    record = run_episode(Episode(parsed(BACK), controller, rate, 1))
    assert (record.status, record.reason) == ("ok", None)
    assert record.junctions[CENTRE].waiting_by_movement["N-U"].vehicles > 0


def test_u_turns_that_are_not_served_or_not_counted_are_refused() -> None:
    with pytest.raises(ScenarioError, match="serves U but no turn count uses it"):
        parsed({"approaches.northbound.lanes": "R C LU"})
    with pytest.raises(ScenarioError, match="vehicles turn U but no lane serves it"):
        parsed({"demand.0.northbound.u_turn": 50})


SKEWED = {"approaches.eastbound.heading": 30, "approaches.westbound.heading": 210}
THREE_ARMS = {  # 120 degrees apart
    "approaches.southbound": DROP,
    "approaches.eastbound.heading": 120,
    "approaches.westbound.heading": 240,
    "approaches.northbound.lanes": "R L",
    "approaches.eastbound.lanes": "R C",
    "approaches.westbound.lanes": "C L",
    "demand.0.southbound": DROP,
    "demand.0.northbound": {"left": 100, "cross": 0, "right": 100},
    "demand.0.eastbound": {"left": 0, "cross": 200, "right": 100},
    "demand.0.westbound": {"left": 100, "cross": 200, "right": 0},
    "signal.phases": [
        {"movements": ["N-L"], "green": 10},
        {"movements": ["E-C", "W-C"], "green": 20},
        {"movements": ["W-C", "W-L"], "green": 10},
    ],
}


def test_a_skewed_crossing_has_the_conflicts_of_a_straight_one() -> None:
    straight, skewed = (
        network.build_network(parsed(changes)).intersections[0].movements
        for changes in ({}, SKEWED)
    )
    assert {name: movement.conflicts for name, movement in skewed.items()} == {
        name: movement.conflicts for name, movement in straight.items()
    }


def test_three_arms_have_the_movements_that_the_scenario_names() -> None:
    movements = network.build_network(parsed(THREE_ARMS)).intersections[0].movements
    assert {name: set(movement.conflicts) for name, movement in movements.items()} == {
        "N-L": {"E-C", "W-C", "W-L"},
        "N-R": set(),
        "E-C": {"N-L", "W-L"},
        "E-R": set(),
        "W-C": {"N-L"},
        "W-L": {"N-L", "E-C"},
    }


@pytest.mark.parametrize("changes", [SKEWED, THREE_ARMS], ids=["skewed", "three arms"])
@pytest.mark.parametrize(("controller", "rate"), [("traffic-light", None), ("first-come", 0.5)])
def test_roads_at_any_angle_are_driven(
    changes: dict[str, Any], controller: str, rate: float | None
) -> None:
    record = run_episode(Episode(parsed(changes), controller, rate, 1))
    assert (record.status, record.reason) == ("ok", None)
    assert record.junctions[CENTRE].throughput > 0


def test_a_route_has_the_movement_by_which_it_crosses() -> None:
    junction = junction_of("smoke/asymmetric")
    crossing = ("northbound.upstream", "northbound", "eastbound.exit")
    assert movement_of(junction, crossing) == "N-R"
    assert movement_of(junction, crossing[:2]) is None


def test_a_controller_cannot_change_the_facts_it_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "_built", {})  # not the one that other tests use
    intersection = junction_of("smoke/tee").intersection
    for facts in (intersection.lanes, intersection.movements, intersection.phases):
        with pytest.raises(TypeError):
            facts["N-L"] = None


YIELDING_LEFTS = {
    "signal.phases": [
        {"movements": ["N-C", "N-L", "S-C", "S-L"], "permitted": ["N-L", "S-L"], "green": 30},
        {"movements": ["E-C", "E-L", "W-C", "W-L"], "permitted": ["E-L", "W-L"], "green": 30},
    ]
}


def test_dark_lights_have_one_road_whatever_the_program_says() -> None:
    protected, permitted = network.build_network(parsed()), parsed(YIELDING_LEFTS)
    assert network.build_network(permitted).hash == protected.hash
    assert permitted.signal is not None
    filtering = network.build_network(permitted, waiting_lefts=permitted.signal.permitted)
    assert filtering.hash != protected.hash
    waits = {
        name: len(movement.ways[0].shape)
        for name, movement in filtering.junctions[CENTRE].intersection.movements.items()
    }
    assert waits.keys() == protected.junctions[CENTRE].intersection.movements.keys()


def test_a_record_names_the_network_that_was_driven_on() -> None:
    scenario = parsed(YIELDING_LEFTS)
    hashes = {
        name: run_episode(Episode(scenario, name, rate, 1)).network_hash
        for name, rate in (("traffic-light", None), ("unsignalised", None), ("first-come", 0.5))
    }
    assert hashes["unsignalised"] == hashes["first-come"] == network.build_network(scenario).hash
    assert hashes["traffic-light"] != hashes["first-come"]


DUAL_LEFTS = {
    f"approaches.{name}.lanes": lanes
    for names, lanes in ((COMPASS[::2], "RC L L"), (COMPASS[1::2], "RC L"))
    for name in names
}


def test_lefts_that_come_too_near_are_refused_with_the_paths_the_distance_and_the_radius() -> None:
    scenario = parsed(DUAL_LEFTS)
    roads = network.build_network(scenario)
    with pytest.raises(ScenarioError) as caught:
        check_programs(scenario, scenario.programs, roads)
    words = re.fullmatch(
        r"test/a: signal\.phases\[0\]: N-L and S-L conflict but are green together; the paths from "
        r"(northbound_\d) and (southbound_\d) come within (\d\.\d) m of each other: widen the box "
        r"with intersection\.radius = (\d+) \(m, of the corners; default 4\), or split the phase",
        str(caught.value),
    )
    assert words is not None
    assert float(words[3]) < 3.2  # a lane's width
    wider = parsed(DUAL_LEFTS | {"intersection.radius": float(words[4])})
    check_programs(wider, wider.programs, network.build_network(wider))


def test_a_wider_radius_lengthens_the_ways_through_and_keeps_the_approaches() -> None:
    narrow, wide = (
        network.build_network(parsed({"intersection.radius": radius}))
        .junctions[CENTRE]
        .intersection
        for radius in (4.0, 12.0)
    )
    assert narrow.lanes.keys() == wide.lanes.keys()
    for name, lane in wide.lanes.items():
        assert lane.length == pytest.approx(narrow.lanes[name].length, abs=0.1)
    for name, movement in wide.movements.items():
        assert movement.ways[0].length > narrow.movements[name].ways[0].length


def test_the_default_radius_is_sumos() -> None:
    said = network.build_network(parsed({"intersection.radius": 4.0}))
    unsaid = network.build_network(parsed())
    assert said.junctions[CENTRE].intersection.lanes == unsaid.junctions[CENTRE].intersection.lanes


@pytest.mark.parametrize("bay", [0.001, 4.9, -1])
def test_a_bay_that_holds_no_vehicle_is_refused_by_its_name(bay: float) -> None:
    with pytest.raises(ScenarioError, match=r"approaches\.eastbound\.bay: .*5"):
        parsed({"approaches.eastbound.bay": bay})


ONE_WAY = {  # eastbound: vehicles arrive in the west and leave in the east
    "approaches.westbound": {
        "heading": 270,
        "length": 100,
        "speed_limit": 13.89,
        "exit_lanes": 0,
    },
    "approaches.eastbound.exit_lanes": 3,
    "approaches.northbound.lanes": "R C",
    "approaches.southbound.lanes": "C L",
    "demand.0.northbound": {"left": 0, "cross": 200, "right": 50},
    "demand.0.southbound": {"left": 100, "cross": 200, "right": 0},
    "demand.0.westbound": DROP,
    "signal.phases": [
        {"movements": ["N-C", "S-C"], "green": 20},
        {"movements": ["S-L", "S-C"], "green": 10},
        {"movements": ["E-C", "E-L"], "green": 20},
    ],
}


def test_a_one_way_road_has_lanes_only_where_it_is_driven() -> None:
    built = network.build_network(parsed(ONE_WAY))
    edges = {edge.getID(): edge for edge in sumolib.net.readNet(str(built.path)).getEdges()}
    assert edges.keys() == {
        *("northbound", "eastbound", "southbound"),
        *("northbound.exit", "eastbound.exit", "southbound.exit"),
    }
    assert edges["eastbound.exit"].getLaneNumber() == 3
    (intersection,) = built.intersections
    assert intersection.approaches == ("northbound", "eastbound", "southbound")
    assert set(intersection.movements) == {"N-C", "N-R", "E-L", "E-C", "E-R", "S-L", "S-C"}


@pytest.mark.parametrize(
    ("controller", "rate"), [("traffic-light", None), ("stop-controlled", None), ("wang", 0.5)]
)
def test_a_one_way_road_is_driven(controller: str, rate: float | None) -> None:
    record = run_episode(Episode(parsed(ONE_WAY), controller, rate, 1))
    assert (record.status, record.reason) == ("ok", None)
    assert record.junctions[CENTRE].throughput > 0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"approaches.northbound.lanes": "R C L", "demand.0.northbound.left": 50},
            'approaches.northbound.lanes: turn "L" leads to no road',
        ),
        (
            {"demand.0.westbound": {"cross": 10}},
            "demand.westbound: vehicles turn C but no lane serves it",
        ),
        ({"approaches.westbound.bay": 50}, "without lanes nobody arrives here"),
    ],
)
def test_what_cannot_be_on_a_one_way_road_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(words)):
        parsed(ONE_WAY | changes)

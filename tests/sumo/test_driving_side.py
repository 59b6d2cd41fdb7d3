"""Traffic on the left is traffic on the right seen in a mirror."""

from typing import Any

import numpy as np
import pytest
from factories.mirror import left_hand, mirrored, on_the_left
from factories.scenarios import network_of, parsed, shipped

from benchmark.control.intersection import Intersection, Movement
from benchmark.learning.traffic import Traffic
from benchmark.pictures import pavement
from benchmark.plumbing.errors import ScenarioError
from benchmark.records.record import Record
from benchmark.scenario.scenario import Scenario, parse_scenario
from benchmark.study.episode import Episode, run_episode
from benchmark.sumo import saturation, signals, webster
from benchmark.sumo.ground import surroundings
from benchmark.sumo.junction import Junction
from benchmark.sumo.network import Network, build_network

MIRRORED = ["colorado-springs/334", "smoke/asymmetric", "smoke/crossing", "smoke/tee"]
NORTH = "approaches.northbound"


def left_network(name: str) -> Network:
    return build_network(left_hand(name))


def junction(network: Network) -> Junction:
    (only,) = network.junctions.values()
    return only


def both(name: str) -> list[tuple[Movement, Movement]]:
    """Every movement on the right with its image on the left."""
    right = junction(network_of(name)).intersection.movements
    left = junction(left_network(name)).intersection.movements
    assert {mirrored(movement) for movement in right} == set(left)
    return [(movement, left[mirrored(movement.id)]) for movement in right.values()]


@pytest.mark.parametrize("name", MIRRORED)
def test_movements_conflict_as_their_images_do(name: str) -> None:
    for movement, image in both(name):
        assert {mirrored(other) for other in movement.conflicts} == image.conflicts
        assert movement.regulated == image.regulated
        assert movement.crosses_oncoming == image.crosses_oncoming
    intersection = junction(left_network(name)).intersection
    assert not any(movement.endswith("-L") for movement in intersection.regulated_movements)
    assert any(movement.endswith("-R") for movement in intersection.regulated_movements)


@pytest.mark.parametrize("name", MIRRORED)
def test_ways_lie_as_their_images_do(name: str) -> None:
    for movement, image in both(name):
        for way, other in zip(movement.ways, image.ways, strict=True):
            assert way.lane[-2:] == other.lane[-2:]  # both count from the kerb
            assert way.length == pytest.approx(other.length, abs=0.1)
            assert way.speed_limit == pytest.approx(other.speed_limit, abs=0.1)
            ends = np.array([other.shape[0], other.shape[-1]]) * (-1, 1)
            assert np.array([way.shape[0], way.shape[-1]]) == pytest.approx(ends, abs=0.1)


@pytest.mark.parametrize("name", MIRRORED)
def test_signals_show_the_same_lights(name: str) -> None:
    right, left = junction(network_of(name)), junction(left_network(name))
    programs = shipped(name).signal, left_hand(name).signal
    assert programs[0]
    assert programs[1]
    signals.check_programs(left_hand(name), left_hand(name).programs, left_network(name))
    for phase, image in zip(programs[0].phases, programs[1].phases, strict=True):
        shown = _lights(right, signals.green(right, phase))
        assert {mirrored(key): lights for key, lights in shown.items()} == _lights(
            left, signals.green(left, image)
        )


def _lights(place: Junction, state: str) -> dict[str, set[str]]:
    shown: dict[str, set[str]] = {}
    for index, movement in place.links.items():
        shown.setdefault(movement, set()).add(state[index])
    return shown


@pytest.mark.parametrize("name", MIRRORED)
def test_loads_and_proposals_are_the_same(name: str) -> None:
    places: list[tuple[Scenario, Intersection]] = [
        (shipped(name), junction(network_of(name)).intersection),
        (left_hand(name), junction(left_network(name)).intersection),
    ]
    proposals = [webster.propose_program(*place) for place in places]
    assert proposals[0].cycle == pytest.approx(proposals[1].cycle, abs=2)
    degrees = [
        saturation.degrees_of_saturation(*place, signal)
        for place, signal in zip(places, [place[0].signal for place in places], strict=True)
        if signal
    ]
    images = {mirrored(movement): degree for movement, degree in degrees[0].items()}
    assert images == pytest.approx(degrees[1], rel=0.05)


def test_an_episode_lets_about_as_many_vehicles_through() -> None:
    right, left = (
        run_episode(Episode(scenario, "traffic-light", None, 1))
        for scenario in (shipped("smoke/crossing"), left_hand("smoke/crossing"))
    )
    assert left.status == right.status == "ok"
    assert _throughput(left) == pytest.approx(_throughput(right), rel=0.15)


def _throughput(record: Record) -> float:
    (measured,) = record.junctions.values()
    return measured.throughput


def test_centre_lines_lie_to_the_right_of_vehicles() -> None:
    centres = [
        np.vstack(pavement.lines(surroundings(network))[1])
        for network in (network_of("smoke/crossing"), left_network("smoke/crossing"))
    ]
    for centre in centres:
        assert np.abs(centre).min(axis=1).max() < 0.3  # m from an axis


def test_learned_controllers_are_skipped() -> None:
    record = run_episode(Episode(left_hand("smoke/crossing"), "wang", 0.5, 1))
    assert record.status == "skipped"
    assert "trained for traffic that drives on the right" in str(record.reason)


def test_nobody_trains_on_the_left() -> None:
    with pytest.raises(ScenarioError, match="driving_side"):
        Traffic(left_hand("smoke/crossing"), 0.5, 1)


def test_the_default_side_leaves_the_hash() -> None:
    assert parsed({"intersection.driving_side": "right"}).hash == parsed().hash
    assert left_hand("smoke/crossing").hash != shipped("smoke/crossing").hash


@pytest.mark.parametrize(
    ("lanes", "words"),
    [("R C L", "L, C, R, U"), ("L R C", "R, C, L, U")],
    ids=["the other side's order", "no order"],
)
def test_lanes_in_another_order_are_refused(lanes: str, words: str) -> None:
    text: dict[str, Any] = on_the_left("colorado-springs/334")
    text["approaches"]["westbound"]["lanes"] = lanes
    with pytest.raises(ScenarioError, match=r"approaches\.westbound\.lanes.*from kerb to centre"):
        parse_scenario(text, source="a.toml", name="a")
    with pytest.raises(ScenarioError, match=words):
        parse_scenario(text, source="a.toml", name="a")


def test_a_road_where_all_keep_to_the_kerb_has_nothing_to_regulate() -> None:
    text = on_the_left("smoke/crossing")
    for road in text["approaches"].values():
        road["lanes"] = "L"
    for period in text["demand"]:
        for counts in period.values():
            if isinstance(counts, dict):
                counts |= {"cross": 0, "right": 0}
    del text["signal"]
    with pytest.raises(ScenarioError, match="all lanes turn left"):
        parse_scenario(text, source="a.toml", name="a")


def test_u_turns_go_round_to_the_right() -> None:
    text = on_the_left("colorado-springs/334")
    text["approaches"]["westbound"]["lanes"] = "L C C RU"
    for period in text["demand"]:
        period["westbound"]["u_turn"] = 10
        period["westbound"]["cross"] = period["westbound"]["cross"] or 10
    text["signal"]["phases"][2]["movements"].append("W-U")
    scenario = parse_scenario(text, source="a.toml", name="a")
    u_turn = junction(build_network(scenario)).intersection.movements["W-U"]
    assert u_turn.regulated
    assert not u_turn.crosses_oncoming
    (way,) = u_turn.ways
    assert way.shape[-1][1] > way.shape[0][1]  # westbound: the other side of the road is north

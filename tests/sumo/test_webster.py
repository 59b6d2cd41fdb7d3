"""Webster's cycle and splits against values worked out by hand; proposals can be driven."""

from typing import Any

import pytest
from factories.counts import PERMITTED, by_flow_ratios, counted
from factories.scenarios import DROP, PAPER, SHIPPED, network_of, parsed, shipped
from factories.traffic import CROSSROADS

from benchmark.control.intersection import Intersection
from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.layout import COMPASS
from benchmark.scenario.scenario import CENTRE
from benchmark.scenario.signal import Signal
from benchmark.sumo import signals, webster
from benchmark.sumo.network import build_network


def test_cycle_and_splits_are_websters() -> None:
    scenario, signal = by_flow_ratios(north=0.3, lefts=0.05, east=0.15)
    timed = webster.retimed(scenario, CROSSROADS, signal)
    # L = 4 * (4 + 1) = 20 s, Y = 0.55, C = (1.5 * 20 + 5) / (1 - 0.55) = 77.8 s,
    # greens = 57.8 * y / 0.55 = 5.25, 31.5, 5.25 and 15.8 s, to whole seconds, never under 5
    assert [phase.green for phase in timed.phases] == [5, 32, 5, 16]
    assert timed.cycle == 78
    assert timed.kind == "fixed"
    assert [phase.name for phase in timed.phases] == [phase.name for phase in signal.phases]
    assert (timed.yellow, timed.all_red) == (signal.yellow, signal.all_red)


@pytest.mark.parametrize("ratio", [0.225, 0.24, 0.5], ids=["Y = 0.9", "Y = 0.96", "Y = 2"])
def test_a_saturated_crossing_has_the_longest_cycle(ratio: float) -> None:
    scenario, signal = by_flow_ratios(north=ratio, lefts=ratio, east=ratio)
    assert webster.retimed(scenario, CROSSROADS, signal).cycle == pytest.approx(180, abs=2)


def test_a_quiet_crossing_has_the_shortest_cycle() -> None:
    scenario, signal = counted({"phases": PERMITTED})
    assert webster.retimed(scenario, CROSSROADS, signal).cycle == 40


def test_more_demand_gives_a_longer_cycle() -> None:
    cycles = []
    for scale in (0.5, 1.0, 1.5, 2.0, 2.5):
        scenario, signal = by_flow_ratios(0.15 * scale, 0.05 * scale, 0.1 * scale)
        cycles.append(webster.retimed(scenario, CROSSROADS, signal).cycle)
    assert cycles == sorted(set(cycles))


def intersection_of(name: str) -> Intersection:
    return network_of(name).junctions["intersection"].intersection


@pytest.mark.parametrize("name", SHIPPED)
def test_a_proposal_lets_every_movement_go_safely(name: str) -> None:
    scenario = shipped(name)
    signal = webster.propose_program(scenario, intersection_of(name))
    signals.check_programs(scenario, {CENTRE: signal}, network_of(name))
    assert Signal.model_validate(signal.model_dump()) == signal
    green = {movement for phase in signal.phases for movement in phase.movements}
    assert green == set(intersection_of(name).regulated_movements)
    assert 3 <= signal.yellow <= 5
    assert 1 <= signal.all_red <= 2
    assert signal.cycle <= webster.LONGEST_CYCLE + len(signal.phases)


@pytest.mark.parametrize("name", PAPER)
def test_a_proposal_is_retimed_to_itself(name: str) -> None:
    signal = webster.propose_program(shipped(name), intersection_of(name))
    assert webster.retimed(shipped(name), intersection_of(name), signal) == signal


@pytest.mark.parametrize("least", [5.0, 12.0, 25.0, 60.0])
def test_no_green_is_shorter_than_its_minimum(least: float) -> None:
    scenario, signal = by_flow_ratios(north=0.15, lefts=0.05, east=0.15)
    phases = [signal.phases[0], signal.phases[1].model_copy(update={"minimum_green": least})]
    held = signal.model_copy(update={"phases": (*phases, *signal.phases[2:])})
    free, timed = (webster.retimed(scenario, CROSSROADS, program) for program in (signal, held))
    assert timed.phases[1].green == max(least, free.phases[1].green)
    assert timed.phases[1].minimum_green == least
    assert all(
        after.green >= before.green for before, after in zip(free.phases, timed.phases, strict=True)
    )


def test_a_green_that_is_held_is_time_lost_for_the_others() -> None:
    scenario, signal = by_flow_ratios(north=0.15, lefts=0.1, east=0.15)
    phases = [phase.model_copy(update={"minimum_green": 5.0}) for phase in signal.phases]
    phases[1] = phases[1].model_copy(update={"green": 40.0, "minimum_green": 40.0})
    timed = webster.retimed(
        scenario, CROSSROADS, signal.model_copy(update={"phases": tuple(phases)})
    )
    # L = 20 s, Y = 0.35 without the held one, C = (1.5 * 20 + 5 + 40) / (1 - 0.35) = 115.4 s,
    # greens = (115.4 - 20 - 40) * y / 0.35 = 15.8, 15.8 and 23.7 s
    assert [phase.green for phase in timed.phases] == [16, 40, 16, 24]


def test_splits_count_right_turns_that_share_a_lane() -> None:
    changes = {f"approaches.{name}.lanes": "RC" for name in COMPASS}
    quiet = {"left": 0, "cross": 100, "right": 10}
    demand = {"begin": 0, "end": 60, **dict.fromkeys(COMPASS, quiet)}
    demand["northbound"] = {"left": 0, "cross": 10, "right": 900}
    phases = [{"movements": [f"{a}-C", f"{b}-C"], "green": 20} for a, b in ("NS", "EW")]
    scenario = parsed(changes | {"demand.0": demand, "signal": {"phases": phases}})
    assert scenario.signal is not None
    intersection = build_network(scenario).junctions[CENTRE].intersection
    north, east = webster.retimed(scenario, intersection, scenario.signal).phases
    assert north.green > 3 * east.green


def test_where_one_movement_alone_needs_green_no_program_is_proposed() -> None:
    changes: dict[str, Any] = {"approaches.westbound": DROP, "signal": DROP}
    counts = {}
    for name, lanes in (("northbound", "C"), ("eastbound", "R"), ("southbound", "R")):
        changes[f"approaches.{name}.lanes"] = lanes
        counts[name] = {
            "left": 0,
            "cross": 300 * (lanes == "C"),
            "right": 200 * (lanes == "R"),
        }
    scenario = parsed(changes | {"demand.0": {"begin": 0, "end": 60, **counts}})
    intersection = build_network(scenario).junctions[CENTRE].intersection
    with pytest.raises(ScenarioError, match="nothing for a signal to separate: only N-C would"):
        webster.propose_program(scenario, intersection)

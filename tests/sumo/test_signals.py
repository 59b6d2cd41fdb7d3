"""Signals: what may be green together, the letter of every link, and the change between phases."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from factories.scenarios import SHIPPED, network_of, parsed, shipped, smoke
from hypothesis import given
from hypothesis import strategies as st

from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.scenario import CENTRE, Scenario
from benchmark.scenario.signal import Signal
from benchmark.sumo import network, signals, tools
from benchmark.sumo.junction import Junction
from benchmark.sumo.network import Network
from benchmark.sumo.signals import PhaseSwitch

TIMES = {"signal.yellow": 3, "signal.all_red": 2}
SLIP = {"approaches.westbound.slip_lane": True}
PHASES = ["N-L S-L", "N-C S-C", "E-L W-L", "E-C W-C"]


def built(changes: dict[str, Any] | None = None) -> tuple[Scenario, Signal, Network]:
    scenario = parsed(changes)
    assert scenario.signal is not None
    return scenario, scenario.signal, network.build_network(scenario)


@cache
def switchable(yellow: float = 3, all_red: float = 2, minimum_green: float = 5) -> Any:
    """The signal of a crossing with short greens, and its junction."""
    changes = {"signal.yellow": yellow, "signal.all_red": all_red}
    changes |= {f"signal.phases.{index}.minimum_green": minimum_green for index in range(4)}
    _, signal, found = built(changes)
    return signal, found.junctions["intersection"]


def _at_centre(signal: Signal | None) -> dict[str, Signal]:
    """The program of the only junction; none where lights are dark."""
    return {CENTRE: signal} if signal else {}


def check(scenario: Scenario, signal: Signal, roads: Network) -> None:
    signals.check_programs(scenario, _at_centre(signal), roads)


def letters(junction: Junction, lights: str) -> dict[str, str]:
    """The letters of each movement's links; one letter where they agree."""
    shown: dict[str, str] = {}
    for index, movement in junction.links.items():
        shown[movement] = "".join(sorted({*shown.get(movement, ""), lights[index]}))
    return shown


def expected(green: Sequence[str] = (), yellow: Sequence[str] = (), **right: str) -> dict[str, str]:
    """Letters of a crossing: red but for these; right turns stop first unless said otherwise."""
    found = {
        f"{approach}-{turn}": "s" if turn == "R" else "r" for approach in "NESW" for turn in "LCR"
    }
    found |= dict.fromkeys(green, "G") | dict.fromkeys(yellow, "y")
    return found | {f"{approach}-R": letter for approach, letter in right.items()}


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_signal_is_accepted(name: str) -> None:
    signal = shipped(name).signal
    assert signal is not None
    signals.check_programs(shipped(name), shipped(name).programs, network_of(name))


def conflicting(permitted: list[str]) -> tuple[Scenario, Signal, Network]:
    together = {"movements": ["N-C", "N-L", "S-C"], "permitted": permitted, "green": 20}
    return built({"signal.phases.1": together})


def test_conflicting_greens_are_refused_with_both_movements_until_one_yields() -> None:
    with pytest.raises(ScenarioError, match=r"test/a: signal\.phases\[1\]: N-L and S-C conflict"):
        check(*conflicting(permitted=[]))
    check(*conflicting(permitted=["N-L"]))


def test_a_permitted_green_that_conflicts_with_nobody_does_not_excuse_the_others() -> None:
    with pytest.raises(ScenarioError, match="N-L and S-C conflict"):
        check(*conflicting(permitted=["N-C"]))


def test_streams_that_both_go_straight_never_share_a_green_whoever_is_said_to_yield() -> None:
    every = ["E-C", "N-C", "S-C"]
    straight = {"movements": every, "permitted": every, "green": 20}
    with pytest.raises(ScenarioError, match="E-C and N-C conflict"):
        check(*built({"signal.phases.1": straight}))


@pytest.mark.parametrize("key", ["yellow", "all_red"])
def test_a_program_of_a_controller_clears_no_faster_than_the_scenarios(key: str) -> None:
    scenario, signal, roads = built({})
    check(scenario, signal.model_copy(update={key: getattr(signal, key) + 1}), roads)
    shorter = signal.model_copy(update={key: getattr(signal, key) - 0.5})
    with pytest.raises(ScenarioError, match=f"signal.{key}: .* expected at least"):
        check(scenario, shorter, roads)


@pytest.mark.parametrize(
    ("phase", "shown"),
    [
        (0, expected(["N-L", "S-L"], N="g", S="g", W="g")),
        (1, expected(["N-C", "S-C"], N="g", S="g", W="g")),
        (3, expected(["E-C", "W-C"], E="g", W="g")),
    ],
)
def test_a_green_shows_each_link_its_letter(phase: int, shown: dict[str, str]) -> None:
    _, signal, found = built(SLIP)
    junction = found.junctions["intersection"]
    lights = signals.green(junction, signal.phases[phase])
    assert letters(junction, lights) == shown


def test_a_right_turn_that_may_not_go_on_red_sees_red() -> None:
    _, signal, found = built({"approaches.northbound.right_on_red": False})
    junction = found.junctions["intersection"]
    lights = [letters(junction, signals.green(junction, phase)) for phase in signal.phases]
    assert [shown["N-R"] for shown in lights] == ["g", "g", "r", "r"]
    assert [shown["S-R"] for shown in lights] == ["g", "g", "s", "s"]
    yellow = signals.between(junction, signal.phases[1], signal.phases[2], "y")
    assert letters(junction, yellow)["N-R"] == "y"


def test_a_phase_that_names_a_right_turn_gives_it_green_beside_the_lefts_of_the_cross_street() -> (
    None
):
    overlap = {"movements": ["E-L", "W-L", "N-R", "S-R"], "green": 10}
    changes = {f"approaches.{name}.right_on_red": False for name in ("northbound", "southbound")}
    scenario, signal, found = built({"signal.phases.2": overlap, **changes})
    check(scenario, signal, found)
    junction = found.junctions["intersection"]
    lights = letters(junction, signals.green(junction, signal.phases[2]))
    assert (lights["N-R"], lights["S-R"], lights["N-C"], lights["E-L"]) == ("g", "g", "r", "G")


def test_a_right_turn_that_no_phase_lets_go_is_refused() -> None:
    changes: dict[str, Any] = {
        "approaches.northbound.right_on_red": False,
        "approaches.northbound.lanes": "R",
        "demand.0.northbound": {"left": 0, "cross": 0, "right": 50},
        "signal.phases.0.movements": ["S-L"],
        "signal.phases.1.movements": ["S-C"],
    }
    with pytest.raises(ScenarioError, match='movement "N-R" is never green; add it to a phase'):
        parsed(changes)


def test_a_permitted_green_is_a_small_g() -> None:
    _, signal, found = conflicting(permitted=["N-L"])
    junction = found.junctions["intersection"]
    lights = letters(junction, signals.green(junction, signal.phases[1]))
    assert (lights["N-L"], lights["N-C"], lights["S-C"]) == ("g", "G", "G")


def test_a_right_turn_from_a_shared_lane_goes_with_its_approach() -> None:
    scenario, junction = smoke("asymmetric"), network_of("smoke/asymmetric").junctions
    assert scenario.signal is not None
    lights = [
        letters(junction["intersection"], signals.green(junction["intersection"], phase))
        for phase in scenario.signal.phases
    ]
    assert [shown["E-R"] for shown in lights] == ["s", "s", "g"]
    assert [shown["E-L"] for shown in lights] == ["r", "r", "g"]


def test_only_those_that_lose_their_green_turn_yellow_and_then_red() -> None:
    scenario = smoke("tee")
    assert scenario.signal is not None
    junction = network_of("smoke/tee").junctions["intersection"]
    cross, left, _ = scenario.signal.phases  # westbound cross goes on through both
    yellow = letters(junction, signals.between(junction, cross, left, "y"))
    red = letters(junction, signals.between(junction, cross, left, "r"))
    assert (yellow["E-C"], yellow["W-C"], yellow["W-L"], yellow["N-L"]) == ("y", "G", "r", "r")
    assert (red["E-C"], red["W-C"], red["W-L"], red["N-L"]) == ("r", "G", "r", "r")


def program(scenario: Scenario, signal: Signal | None, found: Network) -> list[dict[str, str]]:
    """The attributes of a program and then of its phases."""
    logic = ElementTree.fromstring(signals.program_xml(_at_centre(signal), found)).find("tlLogic")
    assert logic is not None
    return [dict(logic.attrib), *(dict(phase.attrib) for phase in logic.iter("phase"))]


@pytest.mark.parametrize("name", SHIPPED)
@pytest.mark.parametrize("kind", ["fixed", "actuated", "dark"])
def test_sumo_takes_the_program(name: str, kind: str, tmp_path: Path) -> None:
    signal = shipped(name).signal
    assert signal is not None
    chosen = None if kind == "dark" else signal.model_copy(update={"kind": kind})
    found, path, states = network_of(name), tmp_path / "program.xml", tmp_path / "states.xml"
    save = f'<timedEvent type="SaveTLSStates" source="intersection" dest="{states}"/>'
    text = signals.program_xml(_at_centre(chosen), found)
    path.write_text(text.replace("</additional>", f"{save}</additional>"))
    tools.run_program("sumo", "-n", str(found.path), "-a", str(path), "--end", "5")
    shown = {one.attrib["programID"] for one in ElementTree.parse(states).iter("tlsState")}
    assert shown == {kind}


@pytest.mark.parametrize("name", SHIPPED)
def test_the_cycle_of_a_fixed_program_is_the_signals(name: str) -> None:
    signal = shipped(name).signal
    assert signal is not None
    fixed = signal.model_copy(update={"kind": "fixed"})
    head, *phases = program(shipped(name), fixed, network_of(name))
    assert head["type"] == "static"
    assert sum(float(phase["duration"]) for phase in phases) == pytest.approx(signal.cycle)
    assert len({len(phase["state"]) for phase in phases}) == 1


def test_a_fixed_program_shows_green_yellow_and_all_red_in_turn() -> None:
    _, *phases = program(*built(TIMES))
    assert [(phase["name"], float(phase["duration"])) for phase in phases] == [
        row
        for name, green in zip(PHASES, [10, 20, 10, 20], strict=True)
        for row in ((name, green), ("yellow", 3), ("all red", 2))
    ]


def test_each_change_of_a_program_leads_from_its_green_to_the_next() -> None:
    scenario, junction = smoke("tee"), network_of("smoke/tee").junctions["intersection"]
    _, *phases = program(scenario, scenario.signal, network_of("smoke/tee"))
    shown = [letters(junction, phase["state"]) for phase in phases]
    assert "".join(lights["E-C"] for lights in shown) == "Gyr" + "rrr" + "rrr"
    assert "".join(lights["W-C"] for lights in shown) == "GGG" + "Gyr" + "rrr"
    assert "".join(lights["W-L"] for lights in shown) == "rrr" + "Gyr" + "rrr"
    assert "".join(lights["N-L"] for lights in shown) == "rrr" + "rrr" + "Gyr"


def test_a_program_without_change_times_has_only_greens() -> None:
    _, *phases = program(*built({"signal.yellow": 0, "signal.all_red": 0}))
    assert [phase["name"] for phase in phases] == PHASES


def test_an_actuated_program_bounds_its_greens() -> None:
    changes = {**TIMES, "signal.kind": "actuated", "signal.phases.1.minimum_green": 7}
    head, *phases = program(*built(changes))
    assert head["type"] == "actuated"
    assert [(float(p["minDur"]), float(p["maxDur"])) for p in phases if "minDur" in p] == [
        *((5, 10), (7, 20), (5, 10), (5, 20))
    ]


def test_dark_lights_show_everybody_g() -> None:
    scenario, _, found = built()
    _, only = program(scenario, None, found)
    assert only["state"] == "G" * len(found.junctions["intersection"].links)
    assert float(only["duration"]) >= 86400


def test_before_the_first_command_the_switch_shows_nothing() -> None:
    switch = PhaseSwitch(*switchable())
    assert switch.request(None, 0.0) is None
    assert switch.request("no such phase", 1.0) is None
    assert switch.phase is None


def test_a_change_takes_yellow_and_all_red_to_the_second() -> None:
    signal, junction = switchable()
    switch = PhaseSwitch(signal, junction)
    shown = []
    for time in range(20):
        lights = switch.request(PHASES[1] if time < 10 else PHASES[3], float(time))
        assert lights is not None
        shown.append((letters(junction, lights)["N-C"], letters(junction, lights)["E-C"]))
    assert shown == [("G", "r")] * 10 + [("y", "r")] * 3 + [("r", "r")] * 2 + [("r", "G")] * 5
    assert switch.phase == PHASES[3]


@pytest.mark.parametrize("tick", range(0, 100, 7))
def test_a_change_is_as_long_in_steps_of_a_tenth_of_a_second(tick: int) -> None:
    signal, junction = switchable()
    switch = PhaseSwitch(signal, junction)
    switch.request(PHASES[1], -10.0)
    shown = ""
    for number in range(60):  # SUMO's clock counts in whole milliseconds
        lights = switch.request(PHASES[3], (tick + number) / 10)
        assert lights is not None
        shown += letters(junction, lights)["N-C"] + letters(junction, lights)["E-C"]
    assert shown == "yr" * 30 + "rr" * 20 + "rG" * 10


@pytest.mark.parametrize(
    ("yellow", "all_red", "between"), [(0, 2, "rr"), (2, 0, "yy"), (0, 0, ""), (0, 1, "r")]
)
def test_a_change_without_yellow_or_all_red_leaves_it_out(
    yellow: float, all_red: float, between: str
) -> None:
    signal, junction = switchable(yellow, all_red)
    switch = PhaseSwitch(signal, junction)
    switch.request(PHASES[1], -10.0)
    shown = ""
    for time in range(5):
        lights = letters(junction, switch.request(PHASES[3], float(time)) or "")
        shown += "G" if lights["E-C"] == "G" else lights["N-C"]
    assert shown == between + "G" * (5 - len(between))


def test_a_green_lasts_its_minimum() -> None:
    switch = PhaseSwitch(*switchable(minimum_green=8))
    switch.request(PHASES[1], 0.0)
    phases = []
    for time in range(1, 10):
        switch.request(PHASES[3], float(time))
        phases.append(switch.phase)
    assert phases == [PHASES[1]] * 7 + [None] * 2


def test_a_command_during_a_change_waits_for_its_end() -> None:
    switch = PhaseSwitch(*switchable())
    switch.request(PHASES[1], 0.0)
    phases = []
    for time in range(10, 22):
        switch.request(PHASES[3] if time == 10 else PHASES[0], float(time))
        phases.append(switch.phase)
    assert phases == [None] * 5 + [PHASES[3]] * 5 + [None] * 2


def test_no_command_keeps_what_is() -> None:
    switch = PhaseSwitch(*switchable())
    lights = switch.request(PHASES[1], 0.0)
    assert {switch.request(None, float(time)) for time in range(1, 99)} == {lights}
    assert switch.phase == PHASES[1]


@given(
    requests=st.lists(st.sampled_from([*PHASES, None]), max_size=60),
    times=st.sampled_from([(3, 2, 5), (0, 2, 1), (2, 0, 3), (0, 0, 2)]),
)
def test_conflicting_movements_are_never_green_together(
    requests: list[str | None], times: tuple[float, float, float]
) -> None:
    signal, junction = switchable(*times)
    switch = PhaseSwitch(signal, junction)
    movements = junction.intersection.movements
    yellow, all_red, minimum_green = times
    lost: dict[str, int] = {}  # movement -> when its green ended
    before: set[str] = set()
    gained: dict[str, int] = {}
    for time, name in enumerate(requests):
        lights = switch.request(name, float(time))
        green = (
            {m for m, letter in letters(junction, lights).items() if letter == "G"}
            if lights
            else set()
        )
        assert not any(other in green for one in green for other in movements[one].conflicts)
        for movement in green - before:
            gained[movement] = time
            assert all(
                time - lost[other] >= yellow + all_red
                for other in movements[movement].conflicts & lost.keys()
            )
        for movement in before - green:
            lost[movement] = time
            assert time - gained[movement] >= minimum_green
        before = green

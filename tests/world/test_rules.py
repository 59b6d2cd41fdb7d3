"""The rules: which commands stand, who is held back, and that no RV is carried over the line."""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import pytest
from factories.traffic import CAR, CONFLICT_FREE, CROSSROADS, crossing, crossroads, state, vehicle
from hypothesis import assume, example, given
from hypothesis import strategies as st

from benchmark.control.arbitration import STOP_MARGIN, stopping_speed, undecided
from benchmark.control.controller import Command, Drive, Go, Phase, Stop
from benchmark.control.state import Body, Vehicle
from benchmark.plumbing.errors import ControllerError
from benchmark.world.rules import Orders, Rules

SIGNALISED = crossroads(phases={"N-C S-C": frozenset({"N-C", "S-C"})})
REGULATED = CROSSROADS.regulated_movements
FASTEST = 5.0 + CAR.acceleration  # m/s, of an RV at 5 m/s after a step


def rules(arbitration: Literal["flexible", "own"] = "flexible", lights_on: bool = False) -> Rules:
    return Rules(SIGNALISED, "wang", arbitration, lights_on)


def decide(who: list[Any], commands: Mapping[str, Command], of: Rules | None = None) -> Orders:
    return (of or rules()).decide(state(*who, where=SIGNALISED), commands)


UPSTREAM = {"lane": "northbound.upstream_0", "distance": 80.0}


@pytest.mark.parametrize(
    ("facts", "command", "reason"),
    [
        ({"is_robot": False}, Go(), "Go refused: the vehicle is not an RV"),
        ({"is_robot": False}, Drive(0.0), "Drive refused: the vehicle is not an RV"),
        ({"distance": 30.1}, Go(), "Go refused: the vehicle is not in the decision zone"),
        ({"distance": 30.1}, Stop(), "Stop refused: the vehicle is not in the decision zone"),
        ({}, Drive(2.61), "Drive refused: the acceleration is outside [-4.5, 2.6] m/s2"),
        ({}, Drive(-4.51), "Drive refused: the acceleration is outside [-4.5, 2.6] m/s2"),
        ({}, Drive(math.nan), "Drive refused: the acceleration is not a finite number"),
        ({}, Drive(-math.inf), "Drive refused: the acceleration is not a finite number"),
        ({}, Drive("fast"), "Drive refused: the acceleration is not a finite number"),
        ({}, Drive(None), "Drive refused: the acceleration is not a finite number"),
        ({}, Drive(0.0, 2), "Drive refused: the lane change is not -1, 0 or 1"),
        ({}, Drive(0.0, -1), "Drive refused: the lane on that side does not serve the vehicle"),
        ({"lane": "northbound_2"}, Drive(0.0, 1), "Drive refused: the lane on that side does not"),
        ({"movement": "N-L", "lane": "northbound_3"}, Drive(0.0, 1), "Drive refused: the lane on"),
        (UPSTREAM, Drive(0.0, 1), "Drive refused: the lane on that side does not serve"),
        ({}, "go", "str refused: it is not a command; expected Go, Stop, Drive or Phase"),
        ({}, None, "NoneType refused: it is not a command"),
        ({}, Go, "type refused: it is not a command"),
    ],
)
def test_an_illegal_command_is_refused_with_the_controllers_name(
    facts: dict[str, Any], command: Any, reason: str
) -> None:
    refused, legal = vehicle("rv", **facts), vehicle("other", "E-C")
    of = rules()
    orders = decide([refused, legal], {"rv": command, "other": Go()}, of)
    ((message, times),) = of.refusals.items()
    assert message.startswith(f"wang: {reason}")
    assert times == 1
    assert orders == Orders(speeds={"other": FASTEST})


def test_a_command_for_a_vehicle_outside_the_control_zone_is_refused() -> None:
    of = rules()
    assert decide([vehicle("rv")], {"gone": Stop()}, of) == Orders()
    assert list(of.refusals) == ["wang: Stop refused: the vehicle is not in the control zone"]


@pytest.mark.parametrize(
    ("lights_on", "target", "name", "reason"),
    [
        (False, "intersection", "N-C S-C", "the lights are dark under this controller"),
        (True, "crossing", "N-C S-C", 'there is no such signal; expected "intersection"'),
        (True, "intersection", "N-C", 'unknown phase "N-C"'),
    ],
)
def test_an_illegal_phase_is_refused(lights_on: bool, target: str, name: str, reason: str) -> None:
    of = rules(lights_on=lights_on)
    assert decide([], {target: Phase(name)}, of) == Orders()
    assert of.refusals == {f"wang: Phase refused: {reason}": 1}


def test_a_legal_phase_is_shown() -> None:
    of = rules(lights_on=True)
    assert decide([], {"intersection": Phase("N-C S-C")}, of).phase == "N-C S-C"
    assert decide([], {}, of).phase is None
    assert not of.refusals


def test_refusals_are_counted_by_reason() -> None:
    of, humans = rules(), [vehicle(name, is_robot=False) for name in "abc"]
    for _ in range(2):
        decide(humans, {"a": Go(), "b": Go(), "c": Stop()}, of)
    assert of.refusals == {
        "wang: Go refused: the vehicle is not an RV": 4,
        "wang: Stop refused: the vehicle is not an RV": 2,
    }


def test_reasons_that_are_the_controllers_choice_do_not_pile_up() -> None:
    of = rules(lights_on=True)
    for number in range(1000):
        decide([], {"intersection": Phase(f"phase {number}")}, of)
    assert of.refusals.total() == 1000
    assert len(of.refusals) == 101
    assert of.refusals["wang: a command refused: for one of many more reasons"] == 900


@pytest.mark.parametrize("kind", [float, np.float32, np.float64])
def test_a_limit_is_kept_whatever_the_precision(kind: Any) -> None:
    body = CAR._replace(acceleration=1.1)
    assert float(np.float32(1.1)) > 1.1
    of = rules()
    decide([vehicle(body=body)], {"rv": Drive(kind(1.1))}, of)
    assert not of.refusals
    decide([vehicle(body=body)], {"rv": Drive(kind(1.10001))}, of)
    assert of.refusals.total() == 1


@pytest.mark.parametrize("answer", [None, [], {"rv"}, "rv", 5])
def test_an_answer_that_is_no_mapping_is_an_error_that_names_the_controller(answer: Any) -> None:
    with pytest.raises(ControllerError, match=f"^wang: act returned {type(answer).__name__}; "):
        rules().decide(state(vehicle()), answer)


@pytest.mark.parametrize("acceleration", [-4.5, 2.6, -4.5 - 1e-10, 2.6 + 1e-10, 0])
def test_limits_may_be_reached_with_rounding(acceleration: float) -> None:
    of = rules()
    orders = decide([vehicle(distance=90.0)], {"rv": Drive(acceleration)}, of)
    assert orders.speeds == {"rv": pytest.approx(5 + acceleration)}
    assert not of.refusals


@pytest.mark.parametrize(("lane", "side", "index"), [(1, 1, 2), (2, -1, 1)])
def test_a_lane_that_serves_the_movement_may_be_taken(lane: int, side: Any, index: int) -> None:
    orders = decide([vehicle(lane=f"northbound_{lane}")], {"rv": Drive(0.0, side)})
    assert orders.lanes == {"rv": index}


ANSWERS = st.one_of(
    st.builds(Go),
    st.builds(Stop),
    st.builds(Drive, st.floats() | st.integers() | st.none(), st.integers(-3, 3) | st.text()),
    st.builds(Phase, st.text() | st.none() | st.sampled_from(list(SIGNALISED.phases))),
    st.none() | st.integers() | st.text(),
)


@given(
    commands=st.dictionaries(
        st.sampled_from(["rv", "hv", "far", "gone", "intersection", 5, None]), ANSWERS
    )
)
def test_whatever_a_controller_answers_every_command_stands_or_is_counted(
    commands: dict[Any, Any],
) -> None:
    of = rules(lights_on=True)
    who = [vehicle("rv"), vehicle("hv", is_robot=False), vehicle("far", distance=90.0)]
    orders = decide(who, commands, of)
    assert len(orders.speeds) + (orders.phase is not None) + of.refusals.total() == len(commands)
    assert set(orders.speeds) <= {"rv", "far"}
    assert all(math.isfinite(speed) for speed in orders.speeds.values())


@pytest.mark.parametrize("cell", range(10))
@pytest.mark.parametrize(("longest", "cells"), [("N-C", 3), ("S-L", 8), (None, 8)])
def test_a_go_waits_for_conflicting_vehicles_in_its_cells(
    cell: int, longest: str | None, cells: int
) -> None:
    waiting = {"N-C": 1.0, "S-L": 1.0} | ({longest: 9.0} if longest else {"N-C": 0, "S-L": 0})
    rv = vehicle("rv", "N-C", waiting=waiting["N-C"])
    other = vehicle("other", "S-L", waiting=waiting["S-L"], is_robot=False)
    orders = decide([rv, other, crossing("E-C", cell)], {"rv": Go()})
    assert ("rv" in orders.held_back) == (cell < cells)


@pytest.mark.parametrize("inside", [*REGULATED, "E-R"])
@pytest.mark.parametrize("movement", [*REGULATED, "N-R"])
def test_only_conflicting_movements_hold_each_other_back(movement: str, inside: str) -> None:
    orders = decide([vehicle("rv", movement), crossing(inside, 0)], {"rv": Go()})
    harmless = (
        movement == inside
        or frozenset({movement, inside}) in CONFLICT_FREE
        or "R" in movement + inside
    )
    assert bool(orders.held_back) != harmless


def test_a_go_that_is_held_back_is_a_stop_and_is_reported() -> None:
    of, who = rules(), [vehicle("rv"), crossing("E-C", 0)]
    held = decide(who, {"rv": Go()}, of)
    stopped = decide(who, {"rv": Stop()})
    assert held.speeds == stopped.speeds
    assert held.speeds["rv"] < FASTEST
    assert (held.held_back, stopped.held_back) == ({"rv"}, frozenset())
    assert of.held_back == 1
    assert not of.refusals


def test_a_go_that_passes_is_full_acceleration() -> None:
    assert decide([vehicle("rv", distance=2.0)], {"rv": Go()}) == Orders(speeds={"rv": FASTEST})


@pytest.mark.parametrize(
    ("first", "speed", "held"),
    [
        (Go(), 10.0, False),  # cleared, and it cannot stop within 5 m any more
        (Go(), 2.0, True),  # cleared, but it can still stop
        (Stop(), 10.0, True),  # never cleared
        (Drive(0.0), 10.0, True),
    ],
)
def test_an_rv_that_was_cleared_and_cannot_stop_any_more_stays_cleared(
    first: Command, speed: float, held: bool
) -> None:
    of = rules()
    decide([vehicle("rv", distance=15.0, speed=speed)], {"rv": first}, of)
    near = vehicle("rv", distance=5.0, speed=speed)
    orders = decide([near, crossing("E-C", 0)], {"rv": Go()}, of)
    assert orders.held_back == ({"rv"} if held else set())
    assert (orders.speeds["rv"] == speed + CAR.acceleration) != held


def test_a_clearance_lapses_with_a_step_without_go() -> None:
    of, near = rules(), vehicle("rv", distance=5.0, speed=10.0)
    for command in (Go(), Stop()):
        decide([near], {"rv": command}, of)
    assert decide([near, crossing("E-C", 0)], {"rv": Go()}, of).held_back == {"rv"}


@given(
    distance=st.floats(0, 30),
    speed=st.floats(0, 16),
    inside=st.sampled_from([None, "E-C", "S-C"]),
    first=st.sampled_from([Go(), Stop()]),
)
def test_where_a_decision_is_not_asked_for_go_and_stop_are_the_same_order(
    distance: float, speed: float, inside: str | None, first: Command
) -> None:
    rv = vehicle("rv", distance=distance, speed=speed)
    who = [rv] if inside is None else [rv, crossing(inside, 0)]
    before = vehicle("rv", distance=distance + speed, speed=speed)
    speeds = []
    for command in (Go(), Stop()):
        decide([before], {"rv": first}, of := rules())
        speeds.append(decide(who, {"rv": command}, of).speeds["rv"])
    if not undecided(state(*who, where=SIGNALISED)):
        assert speeds[0] == speeds[1]
    elif inside != "E-C":
        assert speeds[0] > speeds[1]


@pytest.mark.parametrize("command", [Go(), Drive(2.6)])
def test_under_own_arbitration_everything_passes(command: Command) -> None:
    of = rules("own")
    orders = decide([vehicle("rv", distance=2.0), crossing("E-C", 0)], {"rv": command}, of)
    assert orders.speeds == {"rv": FASTEST}
    assert not orders.held_back
    assert of.held_back == 0


def test_an_rv_without_a_legal_command_drives_itself_again() -> None:
    of, who = rules(), [vehicle("rv"), vehicle("other", "E-C")]
    decide(who, {"rv": Go(), "other": Stop()}, of)
    assert decide(who, {"rv": Drive(99.0), "other": Stop()}, of).released == {"rv"}
    assert decide([], {}, of).released == {"other"}
    assert decide([], {}, of).released == set()


STEPS = st.sampled_from([0.1, 0.25, 0.5, 1.0])


@pytest.mark.parametrize(
    ("distance", "deceleration", "step", "speed"),
    [
        (1.0, 2.0, 1.0, 0.0),
        (0.2, 2.0, 1.0, 0.0),
        (-3.0, 2.0, 1.0, 0.0),
        (9.0, 2.0, 1.0, 4.0),  # 4 m in the step and 4**2 / 4 = 4 m of braking, up to the margin
        (7.0, 2.0, 0.5, 4.0),
        (19.0, 4.5, 1.0, 9.0),
    ],
)
def test_stopping_speed_by_hand(
    distance: float, deceleration: float, step: float, speed: float
) -> None:
    assert stopping_speed(distance, deceleration, step) == pytest.approx(speed)


@given(distance=st.floats(0, 200), deceleration=st.floats(0.5, 9), step=STEPS)
def test_braking_from_the_stopping_speed_ends_at_the_margin(
    distance: float, deceleration: float, step: float
) -> None:
    speed = stopping_speed(distance, deceleration, step)
    room = max(0.0, distance - STOP_MARGIN)
    assert speed * step + speed**2 / (2 * deceleration) == pytest.approx(room, abs=1e-6)


@given(distance=st.floats(0, 200), deceleration=st.floats(0.5, 9), step=STEPS)
def test_who_keeps_to_the_stopping_speed_never_passes_the_margin_nor_brakes_harder(
    distance: float, deceleration: float, step: float
) -> None:
    left, speed = distance, stopping_speed(distance, deceleration, step)
    for _ in range(1000):
        left -= speed * step
        before, speed = speed, stopping_speed(left, deceleration, step)
        assert speed >= before - deceleration * step - 1e-6
    assert left >= min(distance, STOP_MARGIN) - 1e-6
    assert left <= max(distance, STOP_MARGIN)


COMMANDS = st.one_of(
    st.just(Stop()), st.just(Go()), st.builds(Drive, st.floats(-4.5, 2.6), st.just(0))
)


def drive(rv: Vehicle, orders: Orders, step: float) -> Vehicle:
    """An RV a step later, as SUMO moves it within what its body can do."""
    low = max(0.0, rv.speed - rv.body.deceleration * step)
    speed = min(max(orders.speeds[rv.id], low), rv.speed + rv.body.acceleration * step)
    return rv._replace(speed=speed, distance=rv.distance - speed * step)


@given(
    distance=st.floats(1, 30),
    speed=st.floats(0, 16),
    step=STEPS,
    commands=st.lists(COMMANDS, min_size=60, max_size=60),
)
@example(distance=30.0, speed=10.0, step=1.0, commands=[Drive(2.6)] * 60)
@example(distance=30.0, speed=10.0, step=0.1, commands=[Go()] * 60)
def test_no_command_carries_an_rv_that_is_not_cleared_over_the_line(
    distance: float, speed: float, step: float, commands: list[Command]
) -> None:
    assume(speed**2 / (2 * CAR.deceleration) <= distance - STOP_MARGIN)  # it can stop
    where = crossroads(step=step)
    of = Rules(where, "wang", "flexible", lights_on=False)
    rv = vehicle("rv", "N-C", distance=distance, speed=speed)
    for command in commands:
        orders = of.decide(state(rv, crossing("E-C", 0), where=where), {"rv": command})
        assert not of.refusals
        rv = drive(rv, orders, step)
        assert rv.distance >= STOP_MARGIN - 1e-6


@given(distance=st.floats(1, 30), speed=st.floats(0, 10), step=STEPS)
def test_a_stop_brings_an_rv_to_rest_at_the_line(
    distance: float, speed: float, step: float
) -> None:
    assume(speed**2 / (2 * CAR.deceleration) <= distance - STOP_MARGIN)
    where = crossroads(step=step)
    of = Rules(where, "wang", "flexible", lights_on=False)
    rv = vehicle("rv", "N-C", distance=distance, speed=speed)
    for _ in range(round(60 / step)):
        rv = drive(rv, of.decide(state(rv, where=where), {"rv": Stop()}), step)
    assert rv.speed < 0.1
    assert rv.distance == pytest.approx(STOP_MARGIN, abs=0.1)


def test_a_stop_brakes_comfortably_where_there_is_room() -> None:
    lorry = Body("truck", length=12.0, acceleration=1.3, deceleration=4.0, maximum_speed=12.0)
    rv = vehicle("rv", "N-C", distance=30.0, speed=9.0, body=lorry)
    of, speeds = rules(), [9.0]
    while rv.speed > 0.1:
        rv = drive(rv, decide([rv], {"rv": Stop()}, of), 1.0)
        speeds.append(rv.speed)
    assert min(b - a for a, b in pairwise(speeds)) >= -2.0 - 1e-9

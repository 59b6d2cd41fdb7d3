"""What is heard of a controller is enough to be judged again, legal or not."""

import json
import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from factories.records import record
from factories.traffic import CROSSROADS, crossing, state, vehicle
from hypothesis import given
from hypothesis import strategies as st

from benchmark.control.controller import Drive, Go, Phase, Stop
from benchmark.control.state import TrafficState
from benchmark.study import action_log
from benchmark.study.actions import Action, Recording, spoken
from benchmark.world.rules import Orders, Rules

WHERE = "intersection"
STATES = [
    state(
        vehicle("a", speed=3.0),
        vehicle("b", "E-C", distance=12.0),
        vehicle("c", "S-L", distance=80.0, lane=CROSSROADS.movements["S-C"].lanes[0]),
        vehicle("hv", "W-C", is_robot=False),
        *([crossing("E-C", cell)] if cell < 9 else []),
        time=float(cell),
    )
    for cell in (0, 5, 9)
]


class Mine:
    """Not a command."""


class MyGo(Go):
    """Not quite a command."""


ACCELERATIONS: Any = st.one_of(
    st.floats(),
    st.floats(-5, 3),
    st.floats(-5, 3, width=32).map(np.float32),
    st.integers(-5, 3),
    st.booleans(),
    st.fractions(-4, 2, max_denominator=9),
    st.sampled_from([None, "fast", 1j, np.int64(1), np.float64("nan"), 2**70]),
)
SIDES: Any = st.sampled_from([-1, 0, 1, 2, 1.0, True, np.int8(-1), None, "left", math.nan])
COMMANDS: Any = st.one_of(
    st.just(Go()),
    st.just(Stop()),
    st.builds(Drive, ACCELERATIONS, SIDES),
    st.builds(Phase, st.sampled_from(["N-C S-C", "none such", "", 7])),
    st.sampled_from([None, "go", Mine(), MyGo(), Go]),
)
TARGETS: Any = st.sampled_from(["a", "b", "c", "hv", "nobody", WHERE, 5, None, ("a",)])
ANSWERS = st.lists(st.dictionaries(TARGETS, COMMANDS, max_size=4), min_size=3, max_size=3)


def judged(
    answers: list[Mapping[Any, Any]], arbitration: Any
) -> tuple[list[Orders], Rules, Recording]:
    """What the rules make of answers to the states, and what was heard."""
    rules, recording = Rules(CROSSROADS, "c", arbitration, lights_on=True), Recording()
    rules.listener = recording.listener(WHERE)
    found = [rules.decide(seen, answer) for seen, answer in zip(STATES, answers, strict=True)]
    return found, rules, recording


@given(answers=ANSWERS, arbitration=st.sampled_from(["own", "flexible"]))
def test_commands_said_again_are_judged_alike_to_the_last_bit(
    answers: list[Mapping[Any, Any]], arbitration: Any
) -> None:
    orders, rules, recording = judged(answers, arbitration)
    again = spoken(_through_a_file(recording.actions), record(), {}).new()
    again.reset(CROSSROADS, 1)
    same, ruled, repeated = judged([dict(again.act(seen)) for seen in STATES], arbitration)
    assert [repr(one) for one in same] == [repr(one) for one in orders]
    assert list(ruled.refusals.items()) == list(rules.refusals.items())
    assert (ruled.held_back, len(repeated.actions)) == (rules.held_back, len(recording.actions))


def _through_a_file(actions: list[Action]) -> list[Action]:
    """As a log keeps them."""
    return [Action(*row) for row in action_log.frame(actions).iter_rows()]


@given(value=st.floats(allow_nan=False, allow_infinity=False))
def test_every_acceleration_survives_to_the_last_bit(value: float) -> None:
    recording = Recording()
    recording.listener(WHERE)({"a": Drive(value)})
    (found,) = _through_a_file(recording.actions)
    assert found.acceleration is not None
    assert found.acceleration.hex() == value.hex()


def test_a_fraction_drives_as_the_float_it_becomes() -> None:
    orders, _, recording = judged([{"a": Drive(Fraction(1, 3))}, {}, {}], "own")  # type: ignore[arg-type]
    assert recording.actions == [Action(0, WHERE, "a", "drive", 1 / 3, 0, None)]
    assert orders[0].speeds == {"a": 3.0 + 1 / 3}


def test_steps_without_commands_count_and_each_junction_by_itself() -> None:
    recording = Recording()
    north, south = recording.listener("north"), recording.listener("south")
    north({})
    north({"a": Go()})
    south({"b": Stop()})
    assert recording.actions == [
        Action(1, "north", "a", "go", None, None, None),
        Action(0, "south", "b", "stop", None, None, None),
    ]


def test_what_stands_in_for_a_controller_says_what_the_record_says_of_it() -> None:
    facts = {"weights_hash": "f" * 64, "rules": "robot vehicles", "arbitration": "own"}
    plugin = spoken([], record("mine", rate=0.5, **facts), {})
    kind = plugin.kind
    assert (plugin.reference, kind.rules, kind.arbitration) == ("mine", "robot vehicles", "own")
    assert (kind.needs_robot_vehicles, plugin.new().weights_hash) == (True, "f" * 64)
    lit = spoken([], record("light", rate=None), {}).kind
    assert (lit.rules, lit.needs_robot_vehicles) == ("signals", False)


@pytest.mark.parametrize("odd", ["a\ud800", "a\n", "'"])
def test_text_that_utf_8_cannot_hold_is_kept_as_far_as_it_can(odd: str) -> None:
    recording = Recording()
    recording.listener(WHERE)({odd: Phase(odd)})
    (found,) = _through_a_file(recording.actions)
    assert found.target == found.name == odd.replace("\ud800", "?")
    assert json.dumps(found)


def test_it_commands_only_as_long_as_there_is_something_to_say() -> None:
    again = spoken([Action(0, WHERE, "a", "go", None, None, None)], record(), {}).new()
    for _ in range(2):
        again.reset(CROSSROADS, 1)
        seen: TrafficState = STATES[0]
        assert [again.act(seen) for _ in range(3)] == [{"a": Go()}, {}, {}]

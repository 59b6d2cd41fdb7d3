"""Scenario files: what loads, what is refused in which words, and what the hash means."""

import datetime
import math
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import tomli_w
from factories.scenarios import DROP, SCENARIOS, SHIPPED, SMOKE, edited, parsed, shipped
from hypothesis import given
from hypothesis import strategies as st

from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.layout import COMPASS
from benchmark.scenario.scenario import json_schema, load_scenario, parse_scenario

NORTH = "approaches.northbound"
DRIVER = "vehicles.car.car_following"
DAY = datetime.date(2026, 1, 1)
TEE = {  # no southbound: nobody arrives from the north, and no road leads there
    "approaches.southbound": DROP,
    "demand.0.southbound": DROP,
    "signal": DROP,
    f"{NORTH}.lanes": "R L",
    "demand.0.northbound": {"left": 9, "right": 9},
    "approaches.eastbound.lanes": "RC",
    "demand.0.eastbound": {"cross": 9, "right": 9},
    "approaches.westbound.lanes": "C L",
    "demand.0.westbound": {"left": 9, "cross": 9},
}
RIGHT_ONLY = {f"approaches.{name}.lanes": "R" for name in COMPASS}
RIGHT_ONLY |= {f"demand.0.{name}": {"right": 300} for name in COMPASS}


def refusal(document: dict[str, Any]) -> str:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(document, source="a.toml", name="test/a")
    return str(caught.value)


def refusal_of_file(path: Path) -> str:
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    return str(caught.value)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_scenario_loads_by_its_name_and_fits_the_schema(name: str) -> None:
    assert shipped(name).name == name
    document = tomllib.loads((SCENARIOS / f"{name}.toml").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(json_schema()).validate(document)


@pytest.mark.parametrize("name", SMOKE)
def test_a_smoke_scenario_lasts_seconds(name: str) -> None:
    assert shipped(name).evaluation.duration <= 120


def test_the_schema_is_a_schema_that_refuses_unknown_keys() -> None:
    jsonschema.Draft202012Validator.check_schema(json_schema())
    validator = jsonschema.Draft202012Validator(json_schema())
    assert validator.is_valid(edited())
    assert not validator.is_valid(edited({f"{NORTH}.laness": "R"}))


@pytest.mark.parametrize(
    "driver",
    [
        {"model": "IDM"},
        {"model": "Krauss", "imperfection": 0.2},
        {"headway": 1.5},
        {"model": "IDM", "imperfection": 0.2},
        {"model": "Wiedemann"},
    ],
)
def test_the_schema_and_the_loader_agree_on_drivers(driver: dict[str, Any]) -> None:
    document = edited({DRIVER: driver})
    if jsonschema.Draft202012Validator(json_schema()).is_valid(document):
        assert parse_scenario(document, "a.toml", "test/a").vehicles["car"].car_following
    else:
        assert refusal(document)


def test_three_approaches_are_enough() -> None:
    assert parsed(TEE).approaches.names() == ("northbound", "eastbound", "westbound")


def test_a_byte_order_mark_does_not_matter(tmp_path: Path) -> None:
    path = tmp_path / "bom.toml"
    path.write_text(tomli_w.dumps(edited()), encoding="utf-8-sig")
    assert load_scenario(path).hash == parsed().hash


MISTAKES: list[tuple[dict[str, Any], str, list[str]]] = [
    # unknown keys
    ({"aproaches": {}}, "aproaches", ['"aproaches"', 'did you mean "approaches"']),
    ({f"{NORTH}.laness": "R"}, f"{NORTH}.laness", ['"laness"', 'did you mean "lanes"']),
    ({"demand.0.northbound.lefft": 1}, "demand[0].northbound.lefft", ['did you mean "left"']),
    ({DRIVER: {"model": "IDM", "headwy": 1}}, f"{DRIVER}.headwy", ['did you mean "headway"']),
    ({"signal.phases.0.gren": 1}, "signal.phases[0].gren", ['did you mean "green"']),
    ({"nonsense": 1}, "nonsense", ["known: schema, title"]),
    # missing keys
    ({"title": DROP}, "title", ["required"]),
    ({f"{NORTH}.heading": DROP}, f"{NORTH}.heading", ["required"]),
    # wrong types
    ({"schema": 2}, "schema", ["got 2", "1"]),
    ({"title": 5}, "title", ["got 5", "text in quotes"]),
    ({f"{NORTH}.length": "long"}, f"{NORTH}.length", ["'long'", "a number"]),
    ({f"{NORTH}.length": True}, f"{NORTH}.length", ["True", "a number"]),
    ({f"{NORTH}.slip_lane": 1}, f"{NORTH}.slip_lane", ["got 1", "true or false"]),
    ({f"{NORTH}.lanes": ["R"]}, f"{NORTH}.lanes", ["text in quotes"]),
    ({"evaluation.seeds": 2.5}, "evaluation.seeds", ["2.5", "whole number"]),
    ({"tags": "paper"}, "tags", ["'paper'", "list in [ ]"]),
    ({NORTH: 5}, NORTH, ["got 5", "a table"]),
    ({"demand.0": 5}, "demand[0]", ["got 5", "a table"]),
    ({DRIVER: 5}, DRIVER, ["got 5", "a table"]),
    # values out of bounds
    ({"demand.0.northbound.left": -5}, "demand[0].northbound.left", ["got -5", "0"]),
    ({"evaluation.duration": math.nan}, "evaluation.duration", ["nan", "finite"]),
    ({f"{NORTH}.heading": -math.inf}, f"{NORTH}.heading", ["-inf", "finite"]),
    ({"demand.0.northbound.left": math.inf}, "demand[0].northbound.left", ["inf", "finite"]),
    ({"evaluation.penetration_rates": [0.5, 1.5]}, "evaluation.penetration_rates[1]", ["1.5"]),
    ({"vehicles.car.kind": "trukc"}, "vehicles.car.kind", ["'trukc'", 'did you mean "truck"']),
    ({DRIVER: {"model": "idm"}}, DRIVER, ["'idm'", "IDM", "Krauss"]),
    ({DRIVER: {"model": "IDM", "headway": 0}}, f"{DRIVER}.headway", ["got 0", "greater"]),
    ({"title": DAY}, "title", ["2026-01-01"]),
    ({"tags": [DAY]}, "tags[0]", ["2026-01-01"]),
    ({f"{NORTH}.heading": DAY}, f"{NORTH}.heading", ["2026-01-01"]),
    ({"demand.0.begin": datetime.time(8)}, "demand[0].begin", ["08:00:00"]),
    # priority
    (
        {"intersection.priority": ["north"]},
        "intersection.priority",
        ['"north"', "northbound, eastbound, southbound, westbound"],
    ),
    (
        {"intersection.priority": list(COMPASS)},
        "intersection.priority",
        ["nobody would stop", "leave out"],
    ),
    # lanes
    ({f"{NORTH}.lanes": "R Q L"}, f"{NORTH}.lanes", ['"Q" in "R Q L"', "use R, C, L or U"]),
    ({f"{NORTH}.lanes": "L C R"}, f"{NORTH}.lanes", ['"L C R"', "from kerb to centre"]),
    ({f"{NORTH}.lanes": "RL C"}, f"{NORTH}.lanes", ['"RL C"', "from kerb to centre"]),
    ({f"{NORTH}.lanes": "RR C L"}, f"{NORTH}.lanes", ['"RR" in "RR C L"', "twice"]),
    ({f"{NORTH}.lanes": " "}, "demand.northbound", ["no lane serves it", "add a lane"]),
    ({f"{NORTH}.lanes": "R C"}, "demand.northbound", ['"R C"', "add a lane or drop the count"]),
    ({"demand.0.northbound.left": 0}, f"{NORTH}.lanes", ['"R C L" serves L', "add the count"]),
    # the intersection as a whole
    (
        {"approaches.westbound": DROP, "approaches.eastbound": DROP},
        "approaches",
        ["expected three or four approaches", "northbound"],
    ),
    ({**TEE, "demand.0.southbound": {"left": 9}}, "demand.southbound", ["remove the counts"]),
    (
        {**TEE, f"{NORTH}.lanes": "R CL", "demand.0.northbound.cross": 9},
        f"{NORTH}.lanes",
        ['turn "C"', "leads to no road"],
    ),
    (
        {**TEE, f"{NORTH}.exit_lanes": 2},
        f"{NORTH}.exit_lanes",
        ["no road beyond", "remove the key"],
    ),
    ({f"{NORTH}.heading": 90}, "approaches", ["clockwise", "90, 90, 180, 270"]),
    ({f"{NORTH}.bay": 150}, NORTH, ["bay (150 m)", "length (100 m)"]),
    ({"intersection.decision_zone": 120}, "intersection", ["120 m", "control_zone (100 m)"]),
    ({**RIGHT_ONLY, "signal": DROP}, "approaches", []),
    # time and traffic
    ({"evaluation.warm_up": 60}, "evaluation", ["warm_up (60 s)", "before duration"]),
    ({"demand": []}, "demand", ["at least 1"]),
    ({"demand.0.begin": 60}, "demand[0]", ["begin (60 s)", "before end (60 s)"]),
    (
        {"demand": [*edited()["demand"], {"begin": 50, "end": 80}]},
        "demand",
        ["periods overlap", "60 s", "50 s"],
    ),
    ({"vehicles.car.share": 0.9}, "vehicles", ["add up to 0.9", "expected 1"]),
    ({"vehicles.my car": {"share": 0}}, "vehicles", ['"my car"', "letters, digits"]),
    # the signal
    ({"signal.phases": []}, "signal.phases", ["at least 2"]),
    ({"signal.kind": "actuatd"}, "signal.kind", ["'actuatd'", 'did you mean "actuated"']),
    ({"signal.phases.0.green": 0}, "signal.phases[0].green", ["got 0", "greater than 0"]),
    (
        {"signal.phases.0.movements": ["N-L", "N-U"]},
        "signal.phases[0]",
        ['unknown movement "N-U"', "expected one of E-C"],
    ),
    ({"signal.phases.0.movements": ["N-L"]}, "signal.phases", ['"S-L" is never green', "add"]),
    ({"signal.phases.0.permitted": ["E-L"]}, "signal.phases[0]", ["E-L", "among movements"]),
    ({"signal.phases.0.minimum_green": 11}, "signal.phases[0]", ["not exceed green"]),
    ({"signal.phases.1.movements": ["N-L", "S-L"]}, "signal", ["same movements", "merge"]),
]


@pytest.mark.parametrize(
    ("changes", "path", "fragments"), MISTAKES, ids=[path for _, path, _ in MISTAKES]
)
def test_a_mistake_is_refused_in_one_line_with_file_path_value_and_remedy(
    changes: dict[str, Any], path: str, fragments: list[str]
) -> None:
    message = refusal(edited(changes))
    assert message.splitlines() == [message]
    assert message.startswith(f"a.toml: {path}: ")
    assert [fragment for fragment in fragments if fragment not in message] == []


def test_a_phase_may_not_name_a_movement_that_the_intersection_lacks() -> None:
    changes = {f"{NORTH}.lanes": "R C", "demand.0.northbound.left": DROP}
    message = refusal(edited(changes))
    assert message.startswith('a.toml: signal.phases[0]: unknown movement "N-L"; expected one of E')


def test_a_hint_never_repeats_what_was_written() -> None:
    wrong_type = refusal(edited({"schema": "1"}))
    wrong_model = refusal(edited({DRIVER: {"model": "IDM", "imperfection": 0.5}}))
    assert 'did you mean "1"' not in wrong_type
    assert 'did you mean "imperfection"' not in wrong_model


def test_every_mistake_of_a_file_is_reported() -> None:
    message = refusal(edited({"title": 5, f"{NORTH}.length": -1, "aproaches": {}}))
    assert sorted(line.split(": ")[1] for line in message.splitlines()) == [
        "approaches.northbound.length",
        "aproaches",
        "title",
    ]


@pytest.mark.parametrize(
    ("content", "fragment"),
    [
        (b"schema = ", "not valid TOML"),
        (b"schema = 1\nschema = 1\n", "not valid TOML"),
        (b'title = "\xff"', "byte 9 is not UTF-8; save the file as UTF-8"),
        (b"tags = " + b"[" * 5000, "not valid TOML"),
        (b"tags = " + b"[" * 400 + b"]" * 400, ""),
        (b"[" + b".".join([b"a"] * 3000) + b"]", ""),
        (b"schema = " + b"9" * 5000, "not valid TOML"),
        (b"", "schema: this key is required"),
    ],
    ids=[
        *("syntax", "duplicate", "not UTF-8", "open lists", "deep lists", "deep tables"),
        *("long number", "empty"),
    ],
)
def test_a_file_that_is_no_scenario_is_refused(
    tmp_path: Path, content: bytes, fragment: str
) -> None:
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    message = refusal_of_file(path)
    assert message.startswith(f"{path}: ")
    assert ": : " not in message
    assert len(message) < 1000
    assert fragment in message


def test_a_syntax_error_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "broken.toml"
    path.write_text("schema = 1\ntitle = crossing\n")
    assert "line 2" in refusal_of_file(path)


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    missing = tmp_path / "missing.toml"
    assert refusal_of_file(missing) == f"{missing}: cannot read the file: No such file or directory"
    assert refusal_of_file(tmp_path) == f"{tmp_path}: cannot read the file: Is a directory"


ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.just(DAY),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text("abmodel"), inner),
    max_leaves=5,
)
PLACES = [
    *("schema", "title", "tags", "evaluation", "evaluation.seeds", "intersection", "approaches"),
    *(
        "intersection.priority",
        NORTH,
        f"{NORTH}.heading",
        f"{NORTH}.lanes",
        f"{NORTH}.bay",
        f"{NORTH}.exit_lanes",
    ),
    *("demand", "demand.0", "demand.0.begin", "demand.0.eastbound", "demand.0.eastbound.left"),
    *("vehicles", "vehicles.car", "vehicles.car.share", "vehicles.bus", DRIVER, f"{DRIVER}.model"),
    *("signal", "signal.yellow", "signal.phases", "signal.phases.0", "signal.phases.0.permitted"),
]


@given(place=st.sampled_from(PLACES), value=ANYTHING)
def test_whatever_stands_in_a_file_it_loads_or_is_refused(place: str, value: Any) -> None:
    try:
        outcome = f"a.toml: {parse_scenario(edited({place: value}), 'a.toml', 'test/a').hash}"
    except ScenarioError as error:
        outcome = str(error)
    assert outcome.startswith("a.toml: ")


@st.composite
def lanes_in_order(draw: st.DrawFn) -> list[str]:
    """Tokens from kerb to centre, where neighbours share at most their common border."""
    cuts = sorted(draw(st.lists(st.integers(0, 2), min_size=1, max_size=6)))
    tokens = []
    for index, first in enumerate(cuts):
        last = draw(st.integers(first, min([2, *cuts[index + 1 : index + 2]])))
        tokens.append("RCL"[first : last + 1])
    return tokens


@given(tokens=lanes_in_order(), data=st.data())
def test_lanes_mean_the_same_in_any_spelling(tokens: list[str], data: st.DataObject) -> None:
    served = {"R": "right", "C": "cross", "L": "left"}
    counts = {served[turn]: 10 for turn in set("".join(tokens))}
    changes = {"signal": DROP, "demand.0.northbound": counts}
    spelt = data.draw(st.sampled_from([" ", "  ", "\t"])).join(
        data.draw(st.sampled_from([str.upper, str.lower]))("".join(data.draw(st.permutations(t))))
        for t in tokens
    )
    plain = parsed({**changes, f"{NORTH}.lanes": " ".join(tokens)})
    assert parsed({**changes, f"{NORTH}.lanes": f" {spelt} "}).hash == plain.hash
    assert plain.approaches.northbound is not None
    assert plain.approaches.northbound.lane_turns == tuple(tokens)


@given(tokens=lanes_in_order())
def test_lanes_from_the_centre_to_the_kerb_are_refused(tokens: list[str]) -> None:
    backwards = " ".join(reversed(tokens))
    if len(set(tokens)) > 1:
        assert "from kerb to centre" in refusal(edited({f"{NORTH}.lanes": backwards}))


@pytest.mark.parametrize(
    "changes",
    [
        {"title": "Another", "tags": ["x"], "sources": ["y"]},
        {"evaluation.seeds": 3, "evaluation.penetration_rates": [1.0]},
        {"evaluation.step": 1.0, "evaluation.warm_up": 0},
        {"intersection.control_zone": 100, "intersection.decision_zone": 30},
        {f"{NORTH}.slip_lane": False},
        {f"{NORTH}.heading": 360},
        {f"{NORTH}.lanes": " r  c l "},
        {f"{NORTH}.bay": 100},
        {f"{NORTH}.upstream_lanes": 3},
        {f"{NORTH}.exit_lanes": 3},
        {"vehicles": DROP},
        {"vehicles.car.kind": "passenger", "vehicles.car.speed_deviation": 0.1},
        {DRIVER: {"model": "IDM", "headway": 1}},
        {"signal.kind": "fixed", "signal.yellow": 4, "signal.all_red": 1},
        {"signal.maximum_gap": 2.0},
        {"intersection.latitude": 38.9, "intersection.longitude": -104.7},
        {"intersection.priority": []},
        {"signal.phases.0.movements": ["S-L", "N-L", "S-L"]},
        {"signal.phases.0.permitted": [], "signal.phases.0.minimum_green": 5},
    ],
    ids=lambda changes: " ".join(changes),
)
def test_scenarios_that_mean_the_same_hash_the_same(changes: dict[str, Any]) -> None:
    assert parsed(changes).hash == parsed().hash


DIFFERENT = [
    {},
    {"evaluation.step": 0.5},
    {"evaluation.duration": 61},
    {"evaluation.warm_up": 10},
    {"intersection.control_zone": 80},
    {"intersection.decision_zone": 20},
    {"intersection.speed_cap": DROP},
    {"intersection.priority": ["northbound", "southbound"]},
    {"intersection.priority": ["eastbound", "westbound"]},
    {f"{NORTH}.heading": 5},
    {f"{NORTH}.length": 120},
    {f"{NORTH}.bay": 60},
    {f"{NORTH}.speed_limit": 14},
    {f"{NORTH}.lanes": "RC L"},
    {f"{NORTH}.lanes": "R CL"},
    {f"{NORTH}.bay": 50, f"{NORTH}.upstream_lanes": 2},
    {f"{NORTH}.exit_lanes": 2},
    {f"{NORTH}.slip_lane": True},
    {"demand.0.end": 50},
    {"demand.0.northbound.left": 101},
    {"vehicles.car.length": 4.5},
    {"vehicles.car.speed_deviation": 0},
    {"vehicles.car.kind": "truck"},
    {DRIVER: {"model": "Krauss"}},
    {DRIVER: {"model": "IDM", "headway": 1.5}},
    {"signal": DROP},
    {"signal.kind": "actuated"},
    {"signal.kind": "actuated", "signal.maximum_gap": 2.0},
    {"signal.yellow": 3},
    {"signal.phases.0.green": 11},
    {"signal.phases.0.permitted": ["N-L"]},
    {"signal.phases": list(reversed(edited()["signal"]["phases"]))},
]


def test_scenarios_that_mean_something_else_hash_differently() -> None:
    hashes = {str(changes): parsed(changes).hash for changes in DIFFERENT}
    assert len(set(hashes.values())) == len(DIFFERENT)


def test_the_order_of_periods_and_of_classes_does_not_change_the_hash() -> None:
    late = {"begin": 60, "end": 90, "northbound": {"left": 5}}
    classes = {"car": {"share": 0.7}, "van": {"share": 0.3}}
    one = {"demand": [*edited()["demand"], late], "vehicles": classes}
    other = {"demand": [late, *edited()["demand"]], "vehicles": dict(reversed(classes.items()))}
    assert parsed(one).hash == parsed(other).hash


def test_comments_key_order_and_number_spelling_do_not_change_the_hash(tmp_path: Path) -> None:
    def backwards(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: backwards(value[key]) for key in reversed(value)}
        return [backwards(one) for one in value] if isinstance(value, list) else value

    text = tomli_w.dumps(backwards(edited()))
    spelt = text.replace("length = 100\n", "length = 100.0  # m\n")
    assert spelt != text
    path = tmp_path / "spelt.toml"
    path.write_text(f"# a comment\n{spelt}")
    assert load_scenario(path).hash == parsed().hash

"""Tables: golden files, names that look like markup, and text that parses back.

After a change that is meant, write the golden files anew with
``PYTHONPATH=tests python tests/reports/test_tables.py``.
"""

import csv
import io
import json
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, get_args

import pytest
from factories.records import SIGNAL, record, unlucky
from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.token import Token
from rich.console import Console

from benchmark.records import leaderboard
from benchmark.records.flags import MARKS
from benchmark.records.leaderboard import Row
from benchmark.records.measures import MEASURES
from benchmark.records.record import Record, Waiting
from benchmark.records.statistics import Estimate
from benchmark.reports import tables, words

GOLDEN = Path(__file__).parent / "golden"
FORMS: tuple[tables.Format, ...] = get_args(tables.Format)
ODD = "odd/<b>50 %|a_b*"


def golden_records() -> Iterator[Record]:
    """Whole numbers over eight seeds, whose means are exact however they are summed."""
    for seed in range(1, 9):
        yield record(SIGNAL, seed, 20 + seed % 4, rate=None, time_loss=30 + seed)
        for rate in (0.1, 0.5):
            less = round(20 * rate)
            yield record("quick", seed, 18 + seed % 2 - less, rate, arbitration="own")
            locks = {"first_gridlock": 420.0 if seed == 3 else None, "gridlock_exposure": 420.0}
            yield record("slow", seed, 25 + seed, rate, travel_time=None, **locks)
            yield unlucky("broken", seed, rate=rate, reason="no weights")
        if seed > 2:
            per_vehicle = Waiting(mean=seed, p95=40, maximum=90, vehicles=200)
            suspect = {"time_loss": 60, "insertion_delay": 30, "throughput": 800, "collisions": 2}
            yield record("creeper", seed, 4, waiting_time_per_vehicle=per_vehicle, **suspect)
    yield unlucky("creeper", 1, status="crashed")
    yield unlucky("creeper", 2)
    yield record("alone", scenario=ODD, rate=None, waiting=7.5, co2=150.5, fuel=48.25, nox=60.0)


def golden_rows() -> list[Row]:
    return leaderboard.rows_of_records(golden_records())


def row(
    scenario: str = "test/a",
    controller: str = "c",
    rate: float | None = 0.5,
    waiting: Estimate | None = None,
    **facts: Any,
) -> Row:
    figures = {"average_waiting_time": waiting} if waiting else {}
    settled = {"scenario_hash": "a" * 64, "rules": "flexible", "figures": figures}
    settled |= {"difference": None}
    return Row(scenario=scenario, controller=controller, rate=rate, **{**settled, **facts})


NAMES = st.text("abc <>|*_`[]{}#\\&~;-=%$^\"',.", min_size=1, max_size=12).map(
    lambda name: f"a{name}b"
)
VALUES = st.floats(-1e6, 1e6)
ESTIMATES = st.one_of(
    st.builds(Estimate, VALUES, VALUES, VALUES, st.integers(2, 10)),
    st.builds(Estimate, VALUES, st.none(), st.none(), st.just(1)),
)
ROWS = st.lists(
    st.builds(
        row,
        scenario=NAMES,
        controller=NAMES,
        rate=st.sampled_from([None, 0.1, 0.5]),
        figures=st.dictionaries(st.sampled_from([measure.key for measure in MEASURES]), ESTIMATES),
        difference=st.one_of(st.none(), ESTIMATES),
        marks=st.sampled_from([(), ("creeps", "blocks")]),
        other=st.dictionaries(st.sampled_from(["failed", "timed out"]), st.integers(1, 9)),
        status=st.sampled_from(get_args(leaderboard.Status)),
        reasons=st.lists(NAMES, max_size=2).map(tuple),
        gridlock=st.one_of(st.none(), ESTIMATES),
    ),
    min_size=1,
    max_size=4,
    unique_by=lambda one: (one.scenario, one.controller, one.rate),
).map(lambda rows: sorted(rows, key=lambda one: (one.scenario, one.rate or 0)))
some = settings(max_examples=50)


@pytest.mark.parametrize("form", FORMS)
def test_a_table_is_as_its_golden_file(form: tables.Format) -> None:
    golden = GOLDEN / f"leaderboard.{form}"
    assert tables.render_leaderboard(golden_rows(), form) == golden.read_text(encoding="utf-8")


@pytest.mark.parametrize("form", FORMS)
def test_a_leaderboard_without_rows_is_a_table_all_the_same(form: tables.Format) -> None:
    assert tables.render_leaderboard([], form).endswith("\n")
    assert list(csv.DictReader(io.StringIO(tables.leaderboard_csv([])))) == []
    assert json.loads(tables.leaderboard_json([])) == []
    assert tables.terminal_tables([], 80) == []
    assert "at 50 %" in tables.table_at_rate([], 0.5)


@pytest.mark.parametrize(
    ("estimate", "digits", "text"),
    [
        (None, 1, "-"),
        (Estimate(12.34, None, None, 1), 1, "12.3"),
        (Estimate(12.34, 11.0, 13.56, 5), 1, "12.3 [11.0, 13.6]"),
        (Estimate(1234.5, 1000.0, 2000.0, 5), 0, "1234 [1000, 2000]"),
        (Estimate(-0.125, -0.25, 0.0, 5), 2, "-0.12 [-0.25, 0.00]"),
    ],
)
def test_a_figure_shows_its_mean_and_interval(
    estimate: Estimate | None, digits: int, text: str
) -> None:
    assert words.mean_and_interval(estimate, digits) == text


@pytest.mark.parametrize(
    ("rate", "text"),
    [(None, "no RVs"), (0.0, "0 %"), (0.07, "7 %"), (0.125, "12.5 %"), (1, "100 %")],
)
def test_a_rate_is_in_percent(rate: float | None, text: str) -> None:
    assert words.percent(rate) == text


def test_notes_hold_every_reason_and_the_start_of_a_long_one() -> None:
    assert tables.row_notes(row(reasons=("creeps", "2 failed (no)"))) == "creeps, 2 failed (no)"
    assert tables.row_notes(row()) == ""
    long = tables.row_notes(row(reasons=("x" * 101,)))
    assert long == "x" * 97 + "..."


@pytest.mark.parametrize(("mean", "note"), [(0.0, ""), (12.4, "12 commands refused an episode")])
def test_notes_hold_refused_commands(mean: float, note: str) -> None:
    figures = {"refused_commands": Estimate(mean, None, None, 1)}
    assert tables.row_notes(row(figures=figures)) == note


SIX = Estimate(20.0, 19.0, 21.0, 6)


@pytest.mark.parametrize(
    ("difference", "sign"),
    [
        (Estimate(-5.0, -6.0, -4.0, 6), "↓ "),
        (Estimate(5.0, 4.0, 6.0, 6), "↑ "),
        (Estimate(-5.0, -6.0, 1.0, 6), ""),
        (Estimate(-5.0, -6.0, -4.0, 5), ""),  # too few seeds
        (Estimate(-5.0, None, None, 1), ""),
        (None, ""),
    ],
)
@pytest.mark.parametrize(("status", "star"), [("ok", ""), ("flagged", "*")])
def test_an_arrow_says_significant_and_a_star_flagged(
    difference: Estimate | None, sign: str, status: str, star: str
) -> None:
    text = tables.table_at_rate([row(waiting=SIX, difference=difference, status=status)], 0.5)
    assert text.splitlines()[-1] == f"| c         | {sign}20.0 [19.0, 21.0]{star} |"


def parsed(text: str) -> tuple[list[str], list[list[list[str]]]]:
    """The headings of a Markdown text and the cells of its tables by row, as a reader sees them."""
    tokens = MarkdownIt("commonmark").enable("table").parse(text)
    headings: list[str] = []
    found: list[list[list[str]]] = []
    for before, token in pairwise([Token("", "", 0), *tokens]):
        if token.type == "table_open":
            found.append([])
        elif token.type == "tr_open":
            found[-1].append([])
        elif token.type == "inline":
            assert token.children is not None
            assert {child.type for child in token.children} <= {"text", "text_special"}
            shown = "".join(child.content for child in token.children)
            if before.type == "heading_open":
                headings.append(shown)
            elif before.type in ("th_open", "td_open"):
                found[-1][-1].append(shown)
    return headings, found


@some
@given(rows=ROWS)
def test_names_that_look_like_markup_are_shown_as_they_are(rows: list[Row]) -> None:
    headings, found = parsed(tables.leaderboard_markdown(rows))
    scenarios = list(dict.fromkeys(one.scenario for one in rows))
    places = list(dict.fromkeys((one.scenario, one.rate) for one in rows))
    at = [f"{scenario} at {words.percent(rate)}" for scenario, rate in places]
    assert headings == ["Leaderboard", *scenarios, "All figures", *at]
    overviews, details = found[: len(scenarios)], found[len(scenarios) :]
    for scenario, (_, *lines) in zip(scenarios, overviews, strict=True):
        here = {one.controller for one in rows if one.scenario == scenario}
        assert {line[0] for line in lines} == here
    for place, (_, *lines) in zip(places, details, strict=True):
        here = {one.controller for one in rows if (one.scenario, one.rate) == place}
        assert {line[0] for line in lines} == here


@some
@given(rows=ROWS)
def test_a_summary_has_a_line_per_controller_and_a_column_per_scenario(rows: list[Row]) -> None:
    _, ((head, *lines),) = parsed(tables.table_at_rate(rows, 0.1))
    here = [one for one in rows if one.rate == 0.1]
    assert head == ["at 10 %", *dict.fromkeys(one.scenario for one in here)]
    assert sorted(line[0] for line in lines) == sorted({one.controller for one in here})
    waits = {
        (one.controller, one.scenario): words.mean_and_interval(one.headline, 1)
        if one.headline or one.status == "ok"
        else one.status
        for one in here
    }
    for name, *cells in lines:
        for scenario, cell in zip(head[1:], cells, strict=True):
            assert waits.get((name, scenario), "-") in cell


def mishaps() -> Iterator[Record]:
    """Controllers that are not ok, each in another way, beside one that is."""
    for seed in (1, 2, 3):
        yield unlucky("some", seed, rate=0.1, reason="no\n|weights_")
    yield unlucky("some", 1, rate=0.5, reason="no")
    yield from (record("late", seed, rate=rate) for seed in (1, 2) for rate in (0.1, 0.5))
    yield unlucky("late", 2, rate=0.5, status="timed out")
    yield from (unlucky("all", 1, rate=rate, status="skipped", reason="tee") for rate in (0.1, 0.5))
    yield unlucky("once", rate=None)
    yield record("fine", rate=0.1)


REMARKS = {
    "some": "failed at 10 %: 3 failed (no |weights_); failed at 50 %: 1 failed (no)",
    "late": "flagged at 50 %: 1 timed out (no reason given)",
    "all": "skipped: 1 skipped (tee)",
    "once": "failed: 1 failed (no reason given)",
    "fine": "",
}


def test_the_overview_says_at_which_rates_a_controller_is_not_ok_and_why() -> None:
    _, (overview, *_) = parsed(tables.leaderboard_markdown(leaderboard.rows_of_records(mishaps())))
    assert overview[0] == ["controller", "10 %", "50 %", "remarks"]
    assert {line[0]: line[-1] for line in overview[1:]} == REMARKS
    cells = {line[0]: line[1:-1] for line in overview[1:]}
    assert cells == {
        "some": ["failed", "failed"],
        "late": ["20.0 [20.0, 20.0]", "20.0*"],
        "all": ["skipped", "skipped"],
        "once": ["failed", "failed"],
        "fine": ["20.0", "-"],
    }


def test_every_form_shows_status_and_reason_of_every_row() -> None:
    rows = leaderboard.rows_of_records(mishaps())
    expected = sorted(
        (name, rate, status)
        for name, by_rate in {
            "some": {0.1: "failed", 0.5: "failed"},
            "late": {0.1: "ok", 0.5: "flagged"},
            "all": {0.1: "skipped", 0.5: "skipped"},
            "once": {0.1: "failed", 0.5: "failed"},
            "fine": {0.1: "ok"},
        }.items()
        for rate, status in by_rate.items()
    )
    assert sorted((one.controller, one.rate, one.status) for one in rows) == expected
    lines = list(csv.DictReader(io.StringIO(tables.leaderboard_csv(rows))))
    assert sorted((one["controller"], float(one["rate"]), one["status"]) for one in lines) == (
        expected
    )
    notes = {one["controller"]: one["notes"] for one in lines if one["rate"] == "0.5"}
    assert notes["late"] == "1 timed out (no reason given)"
    assert notes["all"] == "1 skipped (tee)"
    objects = json.loads(tables.leaderboard_json(rows))
    assert sorted((one["controller"], one["rate"], one["status"]) for one in objects) == expected
    assert {tuple(one["reasons"]) for one in objects if one["controller"] == "some"} == {
        ("3 failed (no |weights_)",),
        ("1 failed (no)",),
    }
    shown = [line for line in REMARKS.items() if line[1]]
    assert tables.row_remarks(rows) == [f"test/a: {name}: {text}" for name, text in sorted(shown)]
    latex = tables.leaderboard_latex(rows)
    assert r"skipped: 1 skipped (tee)" in latex
    assert r"3 failed (no |weights\_)" in latex
    _, (*_, details) = parsed(tables.leaderboard_markdown(rows))
    assert details[0][-2:] == ["status", "notes"]
    assert {line[0]: line[-2] for line in details[1:]} == {
        name: status for name, rate, status in expected if rate == 0.5
    }


def test_two_scenarios_of_one_name_have_their_own_tables() -> None:
    rows = leaderboard.rows_of_records(
        [record(waiting=10, scenario_hash="0" * 64), record(waiting=30, scenario_hash="1" * 64)]
    )
    headings, (first, second, *_) = parsed(tables.leaderboard_markdown(rows))
    assert headings[1:3] == ["test/a (00000000)", "test/a (11111111)"]
    assert (first[1], second[1]) == (["c", "10.0"], ["c", "30.0"])
    (table,) = parsed(tables.table_at_rate(rows, 0.5))[1]
    assert table == [["at 50 %", *headings[1:3]], ["c", "10.0", "30.0"]]


@some
@given(rows=ROWS)
def test_a_csv_table_parses_back_to_the_last_bit(rows: list[Row]) -> None:
    lines = list(csv.DictReader(io.StringIO(tables.leaderboard_csv(rows))))
    for one, line in zip(rows, lines, strict=True):
        assert (line["scenario"], line["controller"]) == (one.scenario, one.controller)
        assert line["rate"] == ("" if one.rate is None else repr(one.rate))
        assert line["notes"] == tables.row_notes(one)
        figures = {**one.figures, "difference_to_signal": one.difference}
        for key in ["difference_to_signal", *(measure.key for measure in MEASURES)]:
            figure = figures.get(key)
            ends = (figure.mean, figure.low, figure.high) if figure else (None, None, None)
            written = [line[key], line[f"{key}_low"], line[f"{key}_high"]]
            assert [float(text) if text else None for text in written] == list(ends)


@some
@given(rows=ROWS)
def test_a_json_table_parses_back_to_the_same_rows(rows: list[Row]) -> None:
    def estimate(facts: dict[str, Any] | None) -> Estimate | None:
        return Estimate(**facts) if facts else None

    assert rows == [
        Row(
            **{
                **facts,
                "figures": {key: estimate(one) for key, one in facts["figures"].items()},
                "difference": estimate(facts["difference"]),
                "gridlock": estimate(facts["gridlock"]),
                "marks": tuple(facts["marks"]),
                "reasons": tuple(facts["reasons"]),
            }
        )
        for facts in json.loads(tables.leaderboard_json(rows))
    ]


@some
@given(rows=ROWS)
def test_latex_has_no_sign_that_tex_would_act_on(rows: list[Row]) -> None:
    lines = tables.leaderboard_latex(rows).splitlines()
    body = [line for line in lines if " & " in line and not line.startswith("% ")]
    for line in body:
        literal = re.sub(r"\\[&%$#_{}]|\\text\w+\{\}|\\ensuremath\{[<>]\}", "", line)
        literal = re.sub(r"\$\\(?:down|up)arrow\$|\\[\^~]\{\}|\\\\$", "", literal)
        assert not re.search(r"[%$#_{}\\^~]", literal)


@pytest.mark.parametrize("width", [50, 80, 107, 120, 300])
def test_the_terminals_tables_fit_and_show_every_cell(width: int) -> None:
    lows = {rate: rate + 0.5 if rate < 5 else 1000.5 + rate for rate in range(1, 9)}
    rows = [
        row("s[b]", f"controller-[{name}]", rate / 10, Estimate(5000.0, low, 9999.0, 6))
        for name in "xy"
        for rate, low in lows.items()
    ]
    target = io.StringIO()
    console = Console(file=target, width=width)
    shown = tables.terminal_tables(rows, width)
    for table in shown:
        console.print(table)
    text = target.getvalue()
    for name in ("s[b]: average waiting time [s]", "controller-[x]", "controller-[y]"):
        assert text.count(name) == len(shown)
    for rate, low in lows.items():
        assert len(re.findall(rf"\b{10 * rate} %", text)) == 1
        assert len(re.findall(rf"\b{low}-9999\.0", text)) == 2
    assert len(shown) == 1 or width < 300


@pytest.mark.parametrize("width", [50, 80, 120])
def test_a_long_name_takes_no_figures_off_the_terminals_table(width: int) -> None:
    long = "wang?weights=out/train/" + "x" * 46 + "/[b]w"
    assert len(long) == 74
    rows = [
        row("s", name, rate / 10, Estimate(20.0, 19.0, 21.0 + rate, 6))
        for name in (long, long[:-1] + "v", "c")
        for rate in range(1, 9)
    ]
    target = io.StringIO()
    for table in tables.terminal_tables(rows, width):
        Console(file=target, width=width).print(table)
    text = target.getvalue()
    for rate in range(1, 9):
        assert text.count(f"19.0-{21.0 + rate}") == 3
    assert "…" not in text
    most = max(20, width // 3)
    for start in range(0, len(long), most):
        assert long[start : start + most] in text


def test_the_terminal_shows_stars_and_failures() -> None:
    rows = [row(waiting=SIX, status="flagged"), row(controller="d", status="failed")]
    target = io.StringIO()
    (table,) = tables.terminal_tables(rows, 80)
    Console(file=target, width=80).print(table)
    assert re.search(r"c +20\.0\* *\n +19\.0-21\.0 *\n d +failed", target.getvalue())


def test_the_legend_explains_every_mark() -> None:
    assert all(f"{mark}: " in tables.marks_legend() for mark in MARKS)
    assert tables.marks_legend() in tables.leaderboard_markdown([])


if __name__ == "__main__":
    GOLDEN.mkdir(exist_ok=True)
    for name in FORMS:
        text = tables.render_leaderboard(golden_rows(), name)
        (GOLDEN / f"leaderboard.{name}").write_text(text, encoding="utf-8")

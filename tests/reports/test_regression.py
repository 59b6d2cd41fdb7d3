"""What a regression check says: Markdown, JUnit XML, JSON and the terminal."""

import io
import json
from xml.etree import ElementTree as Xml

import pytest
from factories.comparisons import BASE, MADE, THROUGHPUT, WAITING, compared, scaled
from factories.records import record, runs, unlucky
from rich.console import Console

from benchmark.plumbing.plain import shown
from benchmark.records.measures import MEASURES
from benchmark.records.regression import RegressionCheck, Verdict, compare
from benchmark.reports.regression import document, junit, markdown, phrases, terminal

EVIL = "no | idea\n<b onclick=x>\x1b[31m\x00 `rm` &amp; [x](y) \ud7ff"
NAME = "c?green=5&clearance=4"


@pytest.fixture(scope="module")
def every() -> RegressionCheck:
    """A row of each verdict."""
    a, b = {"scenario": "s/gone", "scenario_hash": "b" * 64}, {"scenario": "s/z|<i>"}
    old = [
        *runs(BASE, controller="worse"),
        *runs(BASE, controller="better"),
        *runs(BASE, controller="unproven"),
        *runs(BASE, controller=NAME, rate=None),
        *runs(BASE, controller="missing"),
        *runs(BASE, **a),
        *runs(BASE, controller="fails", **b),
        *runs(BASE[:7], controller="fixed"),
        unlucky("fixed", 8),
    ]
    new = [
        *runs(scaled(2.0), controller="worse"),
        *runs(scaled(0.5), controller="better"),
        *runs([*BASE[:-1], 90.0], controller="unproven"),
        *runs(BASE, controller=NAME, rate=None),
        *runs(BASE[:7], controller="fails", **b),
        unlucky("fails", 8, reason=EVIL, **b),
        *runs(BASE, controller="fixed"),
    ]
    found = compared(old, new, incomparable={("s/gone", "b" * 64): "no scenario of that name"})
    assert {row.verdict for row in found.findings} == {*Verdict}
    return found


def test_the_outcome_is_one_sentence(every: RegressionCheck) -> None:
    assert phrases.outcome_sentence(every) == (
        "Regression at a limit of 5 %: 1 new failure, 1 worse, 1 not comparable, 1 missing, "
        "1 unproven, 1 fixed, 1 better, 1 unchanged."
    )
    assert phrases.outcome_sentence(compared(runs(BASE), runs(BASE))) == (
        "No regression at a limit of 5 %: 1 unchanged."
    )
    assert (
        phrases.outcome_sentence(compared([], []))
        == "Nothing to compare at a limit of 5 %: no rows."
    )


def test_a_row_shows_means_ratio_interval_and_seeds() -> None:
    (row,) = compared(runs(BASE), runs(scaled(1.5))).findings
    assert [*phrases.finding_texts(row).values()] == [
        *("worse", "test/a", "c", "50 %", "waiting [s]", "21.06", "31.59", "1.500"),
        *("+10.53 [+9.84, +11.28]", "8"),
    ]
    (row,) = compared([record(rate=None)], [record(rate=None, throughput=0.0)], THROUGHPUT).findings
    assert [*phrases.finding_texts(row).values()][3:] == [
        *("every", "throughput [veh/h]", "1000.0", "0.0", "0.000", "-1000.0", "1"),
    ]


def test_markdown_shows_what_changed_and_folds_the_rest(every: RegressionCheck) -> None:
    text = markdown.regression_markdown(every, MADE.words())
    head, _, rest = text.partition("<details>")
    assert head.startswith("## Regression at a limit of 5 %: 1 new failure")
    rows = [line for line in head.splitlines() if line.startswith("| ")]
    assert [row.split("|")[1].strip() for row in rows] == [
        *("verdict", "new failure", "worse", "not comparable", "missing"),
        *("unproven", "fixed", "better"),
    ]
    assert "1 unchanged" in rest
    assert r"c?green=5\&clearance=4" in rest
    assert "commit ffffffffffff with changes; rightofway 1.0, sumo 1.28.0" in rest


def test_markdown_shows_foreign_texts_literally(every: RegressionCheck) -> None:
    text = markdown.regression_markdown(every, "")
    (remark,) = [line for line in text.splitlines() if line.startswith("- s/z")]
    assert r"seed 8 failed: no \| idea \<b onclick=x\>" in remark
    assert r"\`rm\` \&amp; \[x\](y)" in remark
    assert "\x1b" not in text
    assert "\x00" not in text
    table = [line for line in text.splitlines() if line.startswith("| ")]
    assert len({line.replace(r"\|", "").count("|") for line in table}) == 1


def test_markdown_of_very_many_rows_stays_small_and_says_so() -> None:
    names = [f"controller-{number}" for number in range(1200)]
    old = [record(name, 1, 20.0) for name in names]
    new = [record(name, 1, 40.0) for name in names]
    text = markdown.regression_markdown(compare(old, new, 0.05), "")
    assert "700 more rows are in the JSON report only" in text
    assert len(text.encode()) < 200_000


def test_junit_has_a_case_per_row_with_its_outcome(every: RegressionCheck) -> None:
    top = Xml.fromstring(junit.junit_xml(every).encode())
    counts = {"tests": "8", "failures": "1", "errors": "1", "skipped": "2"}
    assert top.attrib == {"name": "rightofway regress", **counts}
    outcomes = {child.get("type"): child.tag for case in top.iter("testcase") for child in case}
    assert outcomes == {
        "worse": "failure",
        "new failure": "error",
        "not comparable": "skipped",
        "missing": "skipped",
        None: "system-out",
    }
    suites = {suite.get("name"): suite for suite in top}
    assert suites["s/z|<i>"].get("errors") == "1"
    assert sum(int(suite.get("tests", "")) for suite in top) == 8


def test_junit_names_figures_and_reasons(every: RegressionCheck) -> None:
    top = Xml.fromstring(junit.junit_xml(every).encode())
    cases = {case.get("name"): case for case in top.iter("testcase")}
    assert f"{NAME} at every: average_waiting_time" in cases
    (failure,) = cases["worse at 50 %: average_waiting_time"]
    assert failure.get("message", "").startswith("worse: 21.06 -> 42.12 s, ratio 2.000")
    (error,) = cases["fails at 50 %: average_waiting_time"]
    assert "seed 8 failed: no | idea" in error.get("message", "")
    assert r"\x1b[31m\x00" in error.get("message", "")  # what XML cannot hold
    (skipped,) = cases["c at 50 %: average_waiting_time"]
    assert skipped.get("message") == "no scenario of that name"


def test_json_holds_everything_and_is_read_again_by_its_model(every: RegressionCheck) -> None:
    text = document.regression_json(every, MADE)
    report = document.Report.model_validate_json(text)
    assert (report.exit_code, report.limit, report.reference) == (1, 0.05, MADE)
    assert report.counts == {str(verdict): 1 for verdict in Verdict}
    rows = {row.verdict: row for row in report.rows}
    worse = rows[Verdict.WORSE]
    assert (worse.metric, worse.unit, worse.seeds) == ("average_waiting_time", "s", 8)
    assert (worse.reference, worse.new, worse.ratio) == (21.0625, 42.125, 2.0)
    assert worse.difference is not None
    assert worse.difference.low is not None
    assert worse.difference.low > 0
    assert rows[Verdict.NEW_FAILURE].remark == f"seed 8 failed: {shown(EVIL, keep=chr(10))}"
    assert json.loads(text)["schema"] == 1


def test_json_of_nothing_is_a_report_too() -> None:
    report = document.Report.model_validate_json(document.regression_json(compared([], []), None))
    assert (report.exit_code, report.rows, report.reference) == (2, (), None)


@pytest.mark.parametrize("width", [80, 160])
def test_the_terminal_shows_every_row_with_figures_unbroken(
    width: int, every: RegressionCheck
) -> None:
    screen = Console(width=width, record=True, file=io.StringIO())
    for table in terminal.regression_tables(every, width):
        screen.print(table)
    text = screen.export_text()
    lines = text.splitlines()
    assert max(map(len, lines)) <= width
    for verdict in Verdict:
        assert sum(line.startswith(f"{verdict} ") for line in lines) == 1
    assert "[+19.69, +22.56]" in text
    assert "s/z|<i>: waiting [s]" in text


def test_each_figure_has_a_table_of_its_own() -> None:
    found = terminal.regression_tables(compared(runs(BASE), runs(BASE), WAITING, THROUGHPUT), 80)
    assert [str(table.title) for table in found] == [
        *("test/a: waiting \\[s]", "test/a: throughput \\[veh/h]"),
    ]


def test_every_figure_can_be_shown() -> None:
    rows = compare(runs(BASE), runs(BASE), 0.05, MEASURES).findings
    assert {tuple(phrases.finding_texts(row)) for row in rows} == {phrases.HEAD}

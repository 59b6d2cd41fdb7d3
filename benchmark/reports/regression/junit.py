"""A regression check as JUnit XML, as CI systems show test results."""

import re
from collections.abc import Sequence
from itertools import groupby
from xml.etree import ElementTree as Xml

from benchmark.records.regression import Comparison, Row, Verdict
from benchmark.reports.regression import words

KINDS = {
    Verdict.WORSE: "failure",
    Verdict.NEW_FAILURE: "error",
    Verdict.NOT_COMPARABLE: "skipped",
    Verdict.MISSING: "skipped",
}
NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(comparison: Comparison) -> str:
    """A test suite per scenario, a test case per row."""
    top = Xml.Element("testsuites", {"name": "rightofway regress"} | _counts(comparison.rows))
    by_scenario = sorted(comparison.rows, key=lambda row: row.scenario)
    for scenario, members in groupby(by_scenario, key=lambda row: row.scenario):
        rows = list(members)
        suite = Xml.SubElement(top, "testsuite", {"name": _xml(scenario)} | _counts(rows))
        for row in rows:
            _case(suite, row)
    Xml.indent(top)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{Xml.tostring(top, encoding="unicode")}\n'


def _case(suite: Xml.Element, row: Row) -> None:
    name = f"{row.controller} at {words.rate(row)}: {row.column.key}"
    case = Xml.SubElement(suite, "testcase", classname=_xml(row.scenario), name=_xml(name))
    figures = (
        f"{row.verdict}: {words.number(row.reference, row)} -> {words.number(row.new, row)} "
        f"{row.column.unit}, ratio {words.ratio(row)}, difference {words.difference(row)}, "
        f"{row.seeds} seeds"
    )
    text = "\n".join(part for part in (figures, row.remark) if part)
    kind = KINDS.get(row.verdict)
    if kind is None:
        Xml.SubElement(case, "system-out").text = _xml(text)
    else:
        message = figures if row.verdict is Verdict.WORSE else row.remark
        found = Xml.SubElement(case, kind, type=str(row.verdict), message=_xml(message))
        found.text = _xml(text)


def _counts(rows: Sequence[Row]) -> dict[str, str]:
    kinds = [KINDS.get(row.verdict) for row in rows]
    counts = {
        "tests": len(rows),
        "failures": kinds.count("failure"),
        "errors": kinds.count("error"),
        "skipped": kinds.count("skipped"),
    }
    return {key: str(count) for key, count in counts.items()}


def _xml(text: str) -> str:
    """Text without the characters that XML cannot hold, even escaped."""
    return NOT_XML.sub("?", text)

"""A regression check as JUnit XML, as CI systems show test results."""

import re
from collections.abc import Sequence
from itertools import groupby
from xml.etree import ElementTree as Xml

from benchmark.records.regression import Finding, RegressionCheck, Verdict
from benchmark.reports.regression import phrases

KINDS = {
    Verdict.WORSE: "failure",
    Verdict.NEW_FAILURE: "error",
    Verdict.NOT_COMPARABLE: "skipped",
    Verdict.MISSING: "skipped",
}
NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_xml(check: RegressionCheck) -> str:
    """A test suite per scenario, a test case per finding."""
    top = Xml.Element("testsuites", {"name": "rightofway regress"} | _counts(check.findings))
    by_scenario = sorted(check.findings, key=lambda finding: finding.scenario)
    for scenario, members in groupby(by_scenario, key=lambda finding: finding.scenario):
        findings = list(members)
        suite = Xml.SubElement(top, "testsuite", {"name": _xml(scenario)} | _counts(findings))
        for finding in findings:
            _case(suite, finding)
    Xml.indent(top)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{Xml.tostring(top, encoding="unicode")}\n'


def _case(suite: Xml.Element, finding: Finding) -> None:
    texts = phrases.finding_texts(finding)
    name = f"{finding.controller} at {texts['rate']}: {finding.measure.key}"
    case = Xml.SubElement(suite, "testcase", classname=_xml(finding.scenario), name=_xml(name))
    figures = (
        f"{finding.verdict}: {texts['before']} -> {texts['now']} {finding.measure.unit}, "
        f"ratio {texts['ratio']}, difference {texts['difference']}, {texts['seeds']} seeds"
    )
    text = "\n".join(part for part in (figures, finding.remark) if part)
    kind = KINDS.get(finding.verdict)
    if kind is None:
        Xml.SubElement(case, "system-out").text = _xml(text)
    else:
        message = figures if finding.verdict is Verdict.WORSE else finding.remark
        result = Xml.SubElement(case, kind, type=str(finding.verdict), message=_xml(message))
        result.text = _xml(text)


def _counts(findings: Sequence[Finding]) -> dict[str, str]:
    kinds = [KINDS.get(finding.verdict) for finding in findings]
    counts = {
        "tests": len(findings),
        "failures": kinds.count("failure"),
        "errors": kinds.count("error"),
        "skipped": kinds.count("skipped"),
    }
    return {key: str(count) for key, count in counts.items()}


def _xml(text: str) -> str:
    """Text without the characters that XML cannot hold, even escaped."""
    return NOT_XML.sub("?", text)

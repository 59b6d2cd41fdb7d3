"""A finding of a regression check in words, the same in every report."""

from collections.abc import Sequence

from benchmark.records.regression import Finding, RegressionCheck
from benchmark.records.statistics import Estimate
from benchmark.reports.words import percent

HEAD = (
    *("verdict", "scenario", "controller", "rate", "figure"),
    *("before", "now", "ratio", "difference", "seeds"),
)
RIGHT = HEAD[5:]  # columns that are aligned to the right


def finding_texts(finding: Finding) -> dict[str, str]:
    """The finding's texts by their titles, ``HEAD``."""
    measure, difference = finding.measure, finding.difference
    digits = measure.digits + 1  # one finer than on the leaderboard
    before, now = (
        "-" if mean is None else f"{mean:.{digits}f}" for mean in (finding.reference, finding.new)
    )
    return {
        "verdict": str(finding.verdict),
        "scenario": finding.scenario,
        "controller": finding.controller,
        "rate": _rate(finding),
        "figure": measure.heading,
        "before": before,
        "now": now,
        "ratio": "-" if finding.ratio is None else f"{finding.ratio:.3f}",
        "difference": "-" if difference is None else _signed(difference, digits),
        "seeds": str(finding.seeds),
    }


def _rate(finding: Finding) -> str:
    """The penetration rate; a controller that commands no vehicle stands at every one."""
    return "every" if finding.rate is None else percent(finding.rate)


def _signed(estimate: Estimate, digits: int) -> str:
    """A difference with its interval, as in ``+1.20 [+0.91, +1.42]``."""
    mean = f"{estimate.mean:+.{digits}f}"
    if estimate.low is None:
        return mean
    return f"{mean} [{estimate.low:+.{digits}f}, {estimate.high:+.{digits}f}]"


def outcome_sentence(check: RegressionCheck) -> str:
    """The outcome in one sentence."""
    counts = ", ".join(f"{count} {verdict}" for verdict, count in check.counts().items())
    outcomes = {0: "No regression", 1: "Regression", 2: "Nothing to compare"}
    return (
        f"{outcomes[check.exit_code]} at a limit of {100 * check.limit:g} %: {counts or 'no rows'}."
    )


def remark_lines(findings: Sequence[Finding]) -> list[str]:
    """Remarks, each once and in one line, with the findings that they are of."""
    by_remark: dict[str, list[Finding]] = {}
    for finding in findings:
        if finding.remark:
            by_remark.setdefault(finding.remark, []).append(finding)
    return [one_line(f"{_whose(members)}: {remark}") for remark, members in by_remark.items()]


def one_line(text: str) -> str:
    """Text without line breaks and what steers terminals; controllers' errors may hold any."""
    line = " ".join(text.split())
    return "".join(sign if sign.isprintable() else "?" for sign in line)


def _whose(findings: Sequence[Finding]) -> str:
    places = [f"{each.scenario} {each.controller} {_rate(each)}" for each in findings]
    first, *others = dict.fromkeys(places)
    return f"{first}{f' and {len(others)} more' if others else ''}"

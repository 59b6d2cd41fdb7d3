"""A regression check as Markdown, for pull requests and job summaries."""

from collections.abc import Sequence

from benchmark.records.regression import Finding, RegressionCheck, Verdict
from benchmark.reports.regression import phrases
from benchmark.reports.words import markdown_literal

LONGEST = 500  # rows a table; GitHub refuses summaries above 1 MiB
LONGEST_REMARK = 300  # characters


def regression_markdown(check: RegressionCheck, about: str) -> str:
    """The outcome, what changed, and the unchanged rows folded away.

    Args:
        check: what came out.
        about: where the reference is from.
    """
    unchanged = [finding for finding in check.findings if finding.verdict is Verdict.UNCHANGED]
    changed = [finding for finding in check.findings if finding.verdict is not Verdict.UNCHANGED]
    parts = [f"## {phrases.outcome_sentence(check)}", *([_table(changed)] if changed else [])]
    if remarks := phrases.remark_lines(check.findings):
        parts.append("\n".join(f"- {_plain(remark)}" for remark in remarks[:LONGEST]))
    if unchanged:
        summary = f"<summary>{len(unchanged)} unchanged</summary>"
        parts.append(f"<details>{summary}\n\n{_table(unchanged)}\n\n</details>")
    if about:
        parts.append(f"Reference: {_plain(about)}.")
    return "\n\n".join(parts) + "\n"


def _table(findings: Sequence[Finding]) -> str:
    from tabulate import tabulate

    body = [
        [_plain(text) for text in phrases.finding_texts(finding).values()]
        for finding in findings[:LONGEST]
    ]
    align = ["right" if title in phrases.RIGHT else "left" for title in phrases.HEAD]
    text = tabulate(body, phrases.HEAD, tablefmt="github", colalign=align, disable_numparse=True)
    more = len(findings) - len(body)
    return f"{text}\n\n{more} more rows are in the JSON report only." if more > 0 else text


def _plain(text: str) -> str:
    """Text in one line that Markdown shows literally, cut where it is long."""
    line = phrases.one_line(text)
    return markdown_literal(line if len(line) <= LONGEST_REMARK else f"{line[:LONGEST_REMARK]}...")

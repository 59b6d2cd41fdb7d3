"""A regression check as Markdown, for pull requests and job summaries."""

from collections.abc import Sequence

from benchmark.records.regression import Comparison, Row, Verdict
from benchmark.reports.regression import words
from benchmark.reports.tables import literal

LONGEST = 500  # rows a table; GitHub refuses summaries above 1 MiB
LONGEST_REMARK = 300  # characters


def markdown(comparison: Comparison, about: str) -> str:
    """The outcome, what changed, and the unchanged rows folded away.

    Args:
        comparison: what came out.
        about: where the reference is from.
    """
    unchanged = [row for row in comparison.rows if row.verdict is Verdict.UNCHANGED]
    changed = [row for row in comparison.rows if row.verdict is not Verdict.UNCHANGED]
    parts = [f"## {words.headline(comparison)}", *([_table(changed)] if changed else [])]
    if found := words.remarks(comparison.rows):
        parts.append("\n".join(f"- {_plain(remark)}" for remark in found[:LONGEST]))
    if unchanged:
        summary = f"<summary>{len(unchanged)} unchanged</summary>"
        parts.append(f"<details>{summary}\n\n{_table(unchanged)}\n\n</details>")
    if about:
        parts.append(f"Reference: {_plain(about)}.")
    return "\n\n".join(parts) + "\n"


def _table(rows: Sequence[Row]) -> str:
    from tabulate import tabulate

    body = [[_plain(cell) for cell in words.cells(row)] for row in rows[:LONGEST]]
    align = ["right" if title in words.RIGHT else "left" for title in words.HEAD]
    text = tabulate(body, words.HEAD, tablefmt="github", colalign=align, disable_numparse=True)
    more = len(rows) - len(body)
    return f"{text}\n\n{more} more rows are in the JSON report only." if more > 0 else text


def _plain(text: str) -> str:
    """Text in one line that Markdown shows literally, cut where it is long."""
    line = words.one_line(text)
    return literal(line if len(line) <= LONGEST_REMARK else f"{line[:LONGEST_REMARK]}...")

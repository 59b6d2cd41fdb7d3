"""A regression check for the terminal."""

from typing import TYPE_CHECKING

from benchmark.regression import Comparison, Row, Verdict
from benchmark.regression_report import words

if TYPE_CHECKING:
    from rich.table import Table

STYLES = {
    Verdict.NEW_FAILURE: "bold red",
    Verdict.WORSE: "bold red",
    Verdict.NOT_COMPARABLE: "yellow",
    Verdict.MISSING: "yellow",
    Verdict.UNPROVEN: "yellow",
    Verdict.FIXED: "green",
    Verdict.BETTER: "green",
    Verdict.UNCHANGED: "dim",
}
PLACES = ("scenario", "figure")  # in the tables' titles, which leaves the columns more room
INTERVAL = 14  # characters of one, as in [+0.12, +0.34], which is not to be broken
HEAD = tuple(title for title in words.HEAD if title not in PLACES)


def tables(comparison: Comparison) -> "list[Table]":
    """A table for each scenario and figure; the one with the most urgent row comes first."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in comparison.rows:
        groups.setdefault((row.scenario, words.figure(row)), []).append(row)
    return [_table(*title, rows) for title, rows in groups.items()]


def _table(scenario: str, figure: str, rows: list[Row]) -> "Table":
    from rich.markup import escape
    from rich.table import Table

    title = escape(f"{scenario}: {figure}")
    found = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    for name in HEAD:
        found.add_column(
            name,
            justify="right" if name in words.RIGHT else "left",
            no_wrap=name not in ("controller", "difference"),
            overflow="fold",
            min_width=INTERVAL if name == "difference" else None,
        )
    for row in rows:
        cells = dict(zip(words.HEAD, words.cells(row), strict=True))
        found.add_row(*(escape(cells[name]) for name in HEAD), style=STYLES[row.verdict])
    return found

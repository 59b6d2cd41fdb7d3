"""A regression check for the terminal."""

from typing import TYPE_CHECKING

from benchmark.records.regression import Comparison, Row, Verdict
from benchmark.reports.regression import words

if TYPE_CHECKING:
    from rich.console import JustifyMethod
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
HEAD = tuple(title for title in words.HEAD if title not in PLACES)


def tables(comparison: Comparison, width: int) -> "list[Table]":
    """A table for each scenario and figure; the one with the most urgent row comes first.

    Args:
        comparison: what came out.
        width: of the terminal [characters]; where it is too small, intervals stand below means.
    """
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in comparison.rows:
        groups.setdefault((row.scenario, words.figure(row)), []).append(row)
    return [_table(*title, rows, width) for title, rows in groups.items()]


def _table(scenario: str, figure: str, rows: list[Row], width: int) -> "Table":
    from rich.markup import escape
    from rich.table import Table

    body = [dict(zip(words.HEAD, words.cells(row), strict=True)) for row in rows]
    widest = {name: max(len(name), *(len(cells[name]) for cells in body)) for name in HEAD}
    if sum(widest.values()) + len(HEAD) > width:
        for cells in body:
            cells["difference"] = cells["difference"].replace(" ", "\n", 1)
    title = escape(f"{scenario}: {figure}")
    found = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    for name in HEAD:
        justify: JustifyMethod = "right" if name in words.RIGHT else "left"
        found.add_column(name, justify=justify, no_wrap=name != "controller", overflow="fold")
    for row, cells in zip(rows, body, strict=True):
        found.add_row(*(escape(cells[name]) for name in HEAD), style=STYLES[row.verdict])
    return found

"""A regression check for the terminal."""

from typing import TYPE_CHECKING

from benchmark.records.regression import Finding, RegressionCheck, Verdict
from benchmark.reports.regression import phrases

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
HEAD = tuple(title for title in phrases.HEAD if title not in PLACES)


def regression_tables(check: RegressionCheck, width: int) -> "list[Table]":
    """A table for each scenario and figure; the one with the most urgent finding comes first.

    Args:
        check: what came out.
        width: of the terminal [characters]; where it is too small, intervals stand below means.
    """
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in check.findings:
        groups.setdefault((finding.scenario, finding.measure.heading), []).append(finding)
    return [_table(*title, findings, width) for title, findings in groups.items()]


def _table(scenario: str, figure: str, findings: list[Finding], width: int) -> "Table":
    from rich.markup import escape
    from rich.table import Table

    body = [phrases.finding_texts(finding) for finding in findings]
    widest = {name: max(len(name), *(len(cells[name]) for cells in body)) for name in HEAD}
    if sum(widest.values()) + len(HEAD) > width:
        for cells in body:
            cells["difference"] = cells["difference"].replace(" ", "\n", 1)
    title = escape(f"{scenario}: {figure}")
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    for name in HEAD:
        justify: JustifyMethod = "right" if name in phrases.RIGHT else "left"
        table.add_column(name, justify=justify, no_wrap=name != "controller", overflow="fold")
    for finding, cells in zip(findings, body, strict=True):
        table.add_row(*(escape(cells[name]) for name in HEAD), style=STYLES[finding.verdict])
    return table

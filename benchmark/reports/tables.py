"""Rows -> tables: Markdown, CSV, LaTeX, JSON, and the terminal."""

import csv
import io
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal

from benchmark.records.flags import MARKS
from benchmark.records.leaderboard import Row
from benchmark.records.measures import MEASURES
from benchmark.records.movements import MovementRow
from benchmark.records.ranking import ranking
from benchmark.reports.words import markdown_literal, mean_and_interval, percent

if TYPE_CHECKING:
    from rich.table import Table

Format = Literal["md", "csv", "json", "latex"]

LONGEST_REASON = 100  # of a reason in a table [characters]
SHORTEST_FOLD = 20  # of a name on several lines in a terminal's table [characters]
MARGIN = 3  # of a terminal table's column [characters]
BRIEF = tuple(measure for measure in MEASURES if measure.brief)


def render_leaderboard(rows: Sequence[Row], form: Format) -> str:
    """The whole leaderboard as text that ends in a newline."""
    return {
        "md": leaderboard_markdown,
        "csv": leaderboard_csv,
        "json": leaderboard_json,
        "latex": leaderboard_latex,
    }[form](rows)


def row_notes(row: Row) -> str:
    """Why a row is not ok, and refused commands."""
    refused = row.figures.get("refused_commands")
    notes = [_shortened(reason) for reason in row.reasons]
    if refused and refused.mean > 0:
        notes.append(f"{refused.mean:.0f} commands refused an episode")
    return ", ".join(notes)


def _shortened(reason: str) -> str:
    return reason if len(reason) <= LONGEST_REASON else f"{reason[: LONGEST_REASON - 3]}..."


def row_remarks(rows: Sequence[Row]) -> list[str]:
    """A line for each scenario and controller that has rows which are not ok, for the terminal."""
    return [
        f"{scenario}: {controller}: {remark}"
        for scenario, members in _by_junction(rows)
        for controller in sorted({row.controller for row in members})
        if (remark := _remark([row for row in members if row.controller == controller]))
    ]


def _remark(rows: Sequence[Row]) -> str:
    """What is not ok about a controller's rows, as in ``flagged at 60 %, 70 %: crashes``."""
    groups: dict[tuple[str, str], list[float | None]] = {}
    for row in rows:
        if row.status != "ok":
            reasons = ", ".join(map(_shortened, row.reasons))
            groups.setdefault((row.status, reasons), []).append(row.rate)
    remarks = []
    for (status, reasons), rates in groups.items():
        where = "" if len(rates) == len(rows) else f" at {', '.join(map(percent, rates))}"
        remarks.append(f"{status}{where}: {reasons}")
    return "; ".join(remarks)


def leaderboard_markdown(rows: Sequence[Row]) -> str:
    """An overview per scenario, then every figure by scenario and rate."""
    lines = ["# Leaderboard", "", _preface(rows), ""]
    for scenario, members in _by_junction(rows):
        lines += [f"## {markdown_literal(scenario)}", "", _overview(members, "github"), ""]
    lines += ["# All figures", ""]
    for scenario, members in _by_scenario(rows):
        for rate, group in groupby(members, key=lambda row: row.rate):
            lines += [f"## {markdown_literal(scenario)} at {percent(rate)}", ""]
            lines += [_details(list(group)), ""]
    return "\n".join(lines)


def table_at_rate(rows: Sequence[Row], rate: float) -> str:
    """Controllers by scenarios at one rate, as a Markdown table."""
    from tabulate import tabulate

    at_rate = [row for row in rows if row.rate is not None and abs(row.rate - rate) < 1e-9]
    chosen = [row for row in at_rate if not row.is_of_network]
    scenarios = list(dict.fromkeys(row.scenario for row in chosen))
    cells = {(row.controller, row.scenario): _cell(row) for row in chosen}
    body = [
        [markdown_literal(name), *(cells.get((name, scenario), "-") for scenario in scenarios)]
        for name in ranking(chosen)
    ]
    align = ["left", *["right"] * len(scenarios)]
    head = [f"at {percent(rate)}", *map(markdown_literal, scenarios)]
    return tabulate(body, head, tablefmt="github", colalign=align, disable_numparse=True) + "\n"


def movements_markdown(rows: Sequence[MovementRow]) -> str:
    """Waiting by movement, a table for each scenario and rate; ends in a newline."""
    from tabulate import tabulate

    lines = ["# Waiting by movement", "", "Mean waiting of a movement's vehicles [s].", ""]
    for (scenario, rate), group in groupby(rows, key=lambda row: (row.scenario, row.rate)):
        members = list(group)
        movements = sorted({movement for row in members for movement in row.waiting})
        body = [
            [
                markdown_literal(row.controller),
                *(mean_and_interval(row.waiting.get(movement), 1) for movement in movements),
            ]
            for row in members
        ]
        head = ["controller", *map(markdown_literal, movements)]
        align = ["left", *["right"] * len(movements)]
        table = tabulate(body, head, tablefmt="github", colalign=align, disable_numparse=True)
        lines += [f"## {markdown_literal(scenario)} at {percent(rate)}", "", table, ""]
    return "\n".join(lines)


def leaderboard_latex(rows: Sequence[Row]) -> str:
    """The overview of each scenario as a booktabs tabular."""
    text = "\n\n".join(
        f"% {scenario}\n{_overview(members, 'latex_booktabs')}"
        for scenario, members in _by_junction(rows)
    )
    return text.replace("↓", r"$\downarrow$").replace("↑", r"$\uparrow$") + "\n"


def leaderboard_csv(rows: Sequence[Row]) -> str:
    """A line per row with mean, low and high of every figure."""
    records = [_flat(row) for row in rows]
    target = io.StringIO()
    writer = csv.DictWriter(
        target, fieldnames=list(records[0]) if records else [], lineterminator="\n"
    )
    writer.writeheader()
    writer.writerows(records)
    return target.getvalue()


def leaderboard_json(rows: Sequence[Row]) -> str:
    """An object per row; one of several junctions says which."""
    objects = [asdict(row) for row in rows]
    for row in objects:
        if row["junction"] is None:
            del row["junction"]
    return json.dumps(objects, indent=1) + "\n"


def terminal_tables(rows: Sequence[Row], width: int) -> list["Table"]:
    """The overview of each scenario for a terminal, cut into as many tables as its width asks for.

    Args:
        rows: the leaderboard.
        width: of the terminal [characters].
    """
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    tables = []
    for scenario, members in _by_junction(rows):
        head, body = _matrix(members)
        body = [[_folded(name, width), *map(_two_lines, cells)] for name, *cells in body]
        name_width, *widths = [
            max(len(part) for cell in column for part in cell.split("\n"))
            for column in zip(head, *body, strict=True)
        ]
        for first, last in _runs([MARGIN + own for own in widths], width - name_width - 2):
            title = escape(f"{scenario}: average waiting time [s]")
            table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, show_edge=False)
            table.add_column(head[0], no_wrap=True)
            for title in head[1 + first : 1 + last]:
                table.add_column(title, justify="right")
            for line in body:
                table.add_row(*map(escape, [line[0], *line[1 + first : 1 + last]]))
            tables.append(table)
    return tables


def _folded(name: str, width: int) -> str:
    """A name on as many lines as leave two thirds of the terminal to figures."""
    most = max(SHORTEST_FOLD, width // 3)
    return "\n".join(name[start : start + most] for start in range(0, len(name), most))


def _runs(widths: Sequence[int], room: int) -> list[tuple[int, int]]:
    """First and last column (exclusive) of each table, as many columns as fit, one at least."""
    runs: list[tuple[int, int]] = []
    for index in range(len(widths)):
        if runs and sum(widths[runs[-1][0] : index + 1]) <= room:
            runs[-1] = (runs[-1][0], index + 1)
        else:
            runs.append((index, index + 1))
    return runs


def _two_lines(cell: str) -> str:
    """``12.3 [11.0, 13.6]*`` with its interval below, as narrow as can be."""
    return re.sub(r" \[(\S+), (\S+)\](\*?)$", r"\3\n\1-\2", cell)


def marks_legend() -> str:
    """What marks and signs mean."""
    meanings = "; ".join(f"{mark}: {meaning}" for mark, meaning in MARKS.items())
    return (
        "Mean over seeds [95 % bootstrap interval, from few seeds little but their range]; "
        "↓ or ↑: significantly below or above traffic-light, paired by seed; "
        "* flagged, for the reason beside it: waiting may be low for the wrong reason "
        f"({meanings}; each by the seeds that both have, where the interval is above the limit), "
        "vehicles never "
        "entered or queue beyond the road, vehicles collide, the intersection gridlocked, the "
        "controller was trained on the episodes it is evaluated on, its records are of several "
        "versions, or some episodes are missing from the mean."
    )


def _preface(rows: Sequence[Row]) -> str:
    seeds = max((row.headline.count for row in rows if row.headline), default=0)
    return (
        f"Average waiting time [s]. {marks_legend()} At most {seeds} seeds a cell. In each table "
        "the order is that of the means over the cells that all of its controllers have."
    )


def _by_scenario(rows: Iterable[Row]) -> list[tuple[str, list[Row]]]:
    return [(name, list(group)) for name, group in groupby(rows, key=lambda row: row.scenario)]


def _by_junction(rows: Iterable[Row]) -> list[tuple[str, list[Row]]]:
    """The rows of each scenario that have waiting times, which a network of junctions has not."""
    return _by_scenario(row for row in rows if not row.is_of_network)


def _matrix(rows: Sequence[Row]) -> tuple[list[str], list[list[str]]]:
    """Controllers by rates, in the order of ``ranking``."""
    rates = sorted({row.rate for row in rows}, key=lambda rate: rate or 0.0)
    cells = {(row.controller, row.rate): row for row in rows}
    body = []
    for controller in ranking(rows):
        line = [cells.get((controller, rate)) for rate in rates]
        body.append([controller, *(_cell(row) if row else "-" for row in line)])
    return ["controller", *(percent(rate) for rate in rates)], body


def _cell(row: Row) -> str:
    sign = ""
    if row.difference and row.difference.excludes_zero:
        sign = "↓ " if row.difference.mean < 0 else "↑ "
    if row.headline is None and row.status != "ok":
        return row.status
    return f"{sign}{mean_and_interval(row.headline, 1)}{'*' if row.status == 'flagged' else ''}"


def _overview(rows: Sequence[Row], style: str) -> str:
    from tabulate import tabulate

    head, body = _matrix(rows)
    align = ["left", *["right"] * (len(head) - 1)]
    remarks = [_remark([row for row in rows if row.controller == name]) for name, *_ in body]
    if style == "github":
        body = [[markdown_literal(name), *cells] for name, *cells in body]
        remarks = [markdown_literal(remark) for remark in remarks]
    if any(remarks):
        head, align = [*head, "remarks"], [*align, "left"]
        body = [[*line, remark] for line, remark in zip(body, remarks, strict=True)]
    return tabulate(body, head, tablefmt=style, colalign=align, disable_numparse=True)


def _details(rows: Sequence[Row]) -> str:
    from tabulate import tabulate

    head = ["controller", "rules", "vs signal [s]", *(measure.heading for measure in BRIEF)]
    head += ["gridlock in an hour", "status", "notes"]
    body = [
        [
            *(markdown_literal(row.controller), row.rules, mean_and_interval(row.difference, 1)),
            *(mean_and_interval(row.figures.get(measure.key), measure.digits) for measure in BRIEF),
            mean_and_interval(row.gridlock, 2),
            row.status,
            markdown_literal(row_notes(row)),
        ]
        for row in rows
    ]
    return tabulate(body, head, tablefmt="github", disable_numparse=True)


def _flat(row: Row) -> dict[str, Any]:
    flat: dict[str, Any] = {
        "scenario": row.scenario,
        "scenario_hash": row.scenario_hash,
        "rate": row.rate,
        "controller": row.controller,
        "rules": row.rules,
        "seeds": row.headline.count if row.headline else 0,
        "status": row.status,
        "notes": row_notes(row),
    }
    figures = [(measure.key, row.figures.get(measure.key)) for measure in MEASURES]
    figures.append(("gridlock_probability", row.gridlock))
    for key, estimate in [("difference_to_signal", row.difference), *figures]:
        flat[key] = estimate.mean if estimate else None
        flat[f"{key}_low"] = estimate.low if estimate else None
        flat[f"{key}_high"] = estimate.high if estimate else None
    return flat

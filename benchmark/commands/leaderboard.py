"""The command ``rightofway leaderboard``; it needs no SUMO."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console
from benchmark.commands.options import Records, rate_option
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.records.leaderboard import Row
    from benchmark.records.store import Store


def leaderboard(
    records: Records = Path("out"),
    form: Annotated[
        str | None,
        typer.Option("--format", help="md, csv, json or latex; default: tables for the terminal."),
    ] = None,
    rate: Annotated[
        float | None,
        rate_option(words="One Markdown table of all scenarios at this rate."),
    ] = None,
    movements: Annotated[
        bool, typer.Option("--movements", help="Waiting by movement, as Markdown tables.")
    ] = False,
    variants: Annotated[
        bool, typer.Option(help="Also show controllers with options, as in NAME?option=value.")
    ] = True,
) -> None:
    """Show the leaderboard of a results folder; needs no SUMO."""
    from benchmark.records import leaderboard
    from benchmark.records.store import Store
    from benchmark.reports import tables

    known = ("md", "csv", "json", "latex")
    if form is not None and form not in known:
        raise UsageError(f'--format "{form}": expected {", ".join(known)}')
    if rate is not None and form not in (None, "md"):
        raise UsageError("--rate makes a Markdown table; leave out --format, or give md")
    store = Store(records, notice=console.notice)
    if movements:
        if form not in (None, "md"):
            raise UsageError("--movements makes Markdown tables; leave out --format, or give md")
        console.say(_movements(store, rate, variants), end="")
        return
    rows = leaderboard.rows_of(store.table())
    rows = [row for row in rows if variants or "?" not in row.controller]
    if rate is not None:
        if rate not in (known_rates := sorted({row.rate for row in rows if row.rate is not None})):
            raise UsageError(
                f"--rate {rate:g}: no records; expected one of {', '.join(map(str, known_rates))}"
            )
        console.say(tables.table_at_rate(rows, rate), end="")
    elif form is None:
        print_leaderboard(rows)
    else:
        console.say(tables.render_leaderboard(rows, form), end="")  # type: ignore[arg-type]


def _movements(store: "Store", rate: float | None, variants: bool) -> str:
    from benchmark.records.movements import movement_rows
    from benchmark.reports import tables

    rows = movement_rows(store.table(), store.read())
    rows = [row for row in rows if variants or "?" not in row.controller]
    return tables.movements_markdown([row for row in rows if rate in (None, row.rate)])


def print_leaderboard(rows: "Sequence[Row]") -> None:
    """Print the overview of a results folder, cut to the terminal's width."""
    from benchmark.reports import tables

    screen = console.stdout()
    for table in tables.terminal_tables(rows, screen.width):
        screen.print(table)
        screen.print()
    for remark in tables.row_remarks(rows):
        screen.print(f"[yellow]*[/] {console.literal(remark)}", soft_wrap=True)
    screen.print(console.literal(tables.marks_legend()), soft_wrap=True)

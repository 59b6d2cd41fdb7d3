"""The commands that show what lies in a results folder; they need no SUMO."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.records.leaderboard import Row


def leaderboard(
    records: Annotated[
        Path, typer.Option("--records", help="Results folder, or its records folder.")
    ] = Path("out"),
    form: Annotated[
        str | None,
        typer.Option("--format", help="md, csv, json or latex; default: tables for the terminal."),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="One Markdown table of all scenarios at this rate.")
    ] = None,
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
    folder = records.parent if records.name == "records" else records
    rows = leaderboard.of(Store(folder, notice=console.notice).table())
    rows = [row for row in rows if variants or "?" not in row.controller]
    if rate is not None:
        if rate not in (known_rates := sorted({row.rate for row in rows if row.rate is not None})):
            raise UsageError(
                f"--rate {rate:g}: no records; expected one of {', '.join(map(str, known_rates))}"
            )
        typer.echo(tables.summary(rows, rate), nl=False)
    elif form is None:
        print_leaderboard(rows)
    else:
        typer.echo(tables.render(rows, form), nl=False)  # type: ignore[arg-type]


def compact(
    records: Annotated[
        Path, typer.Option("--records", help="Results folder, or its records folder.")
    ] = Path("out"),
) -> None:
    """Pack records into Parquet, losslessly: large folders take less room and are read faster.

    All commands read both; new records are JSON Lines again, until the next time.
    """
    from benchmark.records.store import Store

    store = Store(records.parent if records.name == "records" else records, notice=console.notice)
    store.require_some()
    before = store.size()
    with store.writing():
        count = store.compact()
    if count:
        typer.echo(
            f"{count} files packed: {before / 1e6:.1f} MB before, {store.size() / 1e6:.1f} MB now"
        )
    else:
        typer.echo("all records are packed already")


def capacity(
    records: Annotated[
        Path, typer.Option("--records", help="Results folder, or its records folder.")
    ] = Path("out"),
) -> None:
    """Show at which demand intersections jam, from runs of scenarios such as 334@700."""
    from benchmark.records import capacity
    from benchmark.records.store import Store

    folder = records.parent if records.name == "records" else records
    found = capacity.curves(Store(folder, notice=console.notice).read())
    if not found:
        raise UsageError(
            f"{folder}: no records of scenarios at demands of their own; "
            "make some with `rightofway run 334@500 334@700 334@900`"
        )
    typer.echo(capacity.markdown(found), nl=False)


def write_leaderboard(rows: "Sequence[Row]", out: Path) -> None:
    """Write the leaderboard into a results folder, as Markdown and as CSV."""
    from benchmark.plumbing.errors import StoreError
    from benchmark.plumbing.files import writing
    from benchmark.reports import tables

    with writing(out, "the leaderboard", StoreError, remedy=""):
        (out / "LEADERBOARD.md").write_text(tables.markdown(rows), encoding="utf-8")
        (out / "leaderboard.csv").write_text(tables.as_csv(rows), encoding="utf-8")


def print_leaderboard(rows: "Sequence[Row]") -> None:
    """Print the overview of a results folder, cut to the terminal's width."""
    from benchmark.reports import tables

    screen = console.stdout()
    for table in tables.terminal(rows, screen.width):
        screen.print(table)
        screen.print()
    for remark in tables.remarks(rows):
        screen.print(f"[yellow]*[/] {console.literal(remark)}", soft_wrap=True)
    screen.print(console.literal(tables.legend()), soft_wrap=True)

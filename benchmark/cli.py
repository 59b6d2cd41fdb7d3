"""The command ``rightofway``: parses, calls, prints. Heavy imports wait inside the commands."""

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark import __version__
from benchmark.errors import RightOfWayError, UsageError
from benchmark.learning import command

if TYPE_CHECKING:
    from rich.console import Console

    from benchmark.episode import Episode
    from benchmark.leaderboard import Row
    from benchmark.record import Record
    from benchmark.store import Store

LARGEST_SEED = 2**31 - 1  # of SUMO
PAPER = "colorado-springs"

app = typer.Typer(
    name="rightofway",
    help="Benchmark suite for mixed-traffic control at intersections.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

Scenarios = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[SCENARIO]...", help="Files, folders or shipped names; default: the paper's four."
    ),
]
OneScenario = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A file or a shipped name, such as 334.")
]


def main() -> None:
    """Run the command; errors a user can cause end in one message and exit code 2."""
    try:
        code = app(standalone_mode=False) or 0
    except RightOfWayError as error:
        _stderr().print(f"[bold red]error:[/] {_literal(str(error))}", soft_wrap=True)
        code = 2
    except (KeyboardInterrupt, typer.Abort):
        code = 130
    except typer.Exit as stop:
        code = stop.exit_code
    except Exception as error:
        if not hasattr(error, "show"):  # typer's usage errors know how to show themselves
            raise
        error.show()
        code = 2
    sys.exit(code)


def _stdout() -> "Console":
    from rich.console import Console

    return Console(highlight=False)


def _stderr() -> "Console":
    from rich.console import Console

    return Console(stderr=True, highlight=False)


def _literal(text: str) -> str:
    from rich.markup import escape

    return escape(text)


def _version(wanted: bool) -> None:
    if wanted:
        from benchmark.sumo_tools import sumo_version

        typer.echo(f"rightofway {__version__}, SUMO {sumo_version()}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show versions.")
    ] = False,
) -> None:
    pass


@app.command("list")
def list_() -> None:
    """List the shipped scenarios and the installed controllers."""
    from rich.table import Table

    from benchmark import catalogue, plugins, scenario
    from benchmark.errors import ControllerError

    scenarios = Table("scenario", "title", box=None)
    for name, path in catalogue.shipped().items():
        scenarios.add_row(name, _literal(scenario.load(path).title))
    controllers = Table("controller", "rules", "description", box=None)
    for name in plugins.discovered():
        try:
            kind = plugins.load(name)
        except ControllerError as error:
            controllers.add_row(name, "broken", _literal(str(error)))
        else:
            controllers.add_row(name, kind.rules, _literal(plugins.description(kind)))
    for table in (scenarios, controllers):
        _stdout().print(table)


@app.command()
def check(
    scenario: Annotated[
        list[str], typer.Argument(metavar="SCENARIO...", help="Files, folders or shipped names.")
    ],
) -> None:
    """Validate scenarios, build and route them, and say what is wrong.

    Lines that begin with ! are findings; what cannot run at all is an error with exit code 2.
    """
    from rich.table import Table

    from benchmark import catalogue
    from benchmark.inspection import inspect

    for one in catalogue.find(scenario):
        found = inspect(one)
        table = Table(
            *("movement", "veh (counts)", "veh (routes)", "share (counts)", "share (routes)"),
            "saturation",
            title=f"{one.name} {one.hash[:12]}, network {found.network_hash[:12]}",
            title_justify="left",
        )
        for share in found.shares:
            degree = found.saturation.get(share.movement)
            table.add_row(
                *(share.movement, f"{share.expected_vehicles:.0f}", str(share.vehicles)),
                *(f"{share.wanted:.1%}", f"{share.realised:.1%}"),
                "-" if degree is None else f"{degree:.2f}",
            )
        _stdout().print(table)
        for finding in found.findings:
            _stdout().print(f"[yellow]![/] {_literal(finding)}", soft_wrap=True)
        count = len(found.findings)
        _stdout().print(f"{count} finding{'s' * (count != 1)}\n" if count else "all well\n")


@app.command()
def show(
    scenario: OneScenario,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="PNG or SVG; default: SCENARIO.png here.")
    ] = None,
) -> None:
    """Draw an intersection: lanes, turns, zones, volumes and the signal program."""
    from benchmark import catalogue, figures

    one = catalogue.one(scenario)
    target = output or Path(f"{one.name.replace('/', '-')}.png")
    figures.draw(one, target)
    typer.echo(str(target))


@app.command()
def signal(scenario: OneScenario) -> None:
    """Propose a signal program from the turning counts, by Webster's method."""
    import tomli_w

    from benchmark import catalogue, network, webster

    one = catalogue.one(scenario)
    roads = network.build(one)
    proposed = webster.propose(one, roads)
    intersection = next(iter(roads.junctions.values())).intersection
    degrees = webster.degrees_of_saturation(one, intersection, proposed)
    worst = max(degrees, key=degrees.__getitem__)
    typer.echo(f"# {one.name}: cycle {proposed.cycle:g} s, Webster's method on the peak counts")
    typer.echo(f"# highest degree of saturation: {worst} {degrees[worst]:.2f}")
    document = proposed.model_dump(mode="json", exclude_defaults=True)
    typer.echo(tomli_w.dumps({"signal": {"kind": proposed.kind, **document}}), nl=False)


@app.command()
def run(
    scenario: Scenarios = None,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            "--controller",
            help="Repeatable; NAME or NAME?option=value&option=value; default: all installed.",
        ),
    ] = None,
    rate: Annotated[
        list[float] | None,
        typer.Option("--rate", min=0, max=1, help="Repeatable; default: the scenario's."),
    ] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Use the seeds 1 to N.")] = None,
    seed: Annotated[
        list[int] | None, typer.Option(min=0, max=LARGEST_SEED, help="Repeatable; this seed.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes side by side; default: one per core.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for records and leaderboard.")] = Path("out"),
) -> None:
    """Run episodes, append their records and print the leaderboard."""
    from benchmark import catalogue, leaderboard, suite
    from benchmark.store import Store

    if seeds and seed:
        raise UsageError("--seeds and --seed exclude each other; give one of them")
    store = Store(out, notice=_notice)
    chosen = suite.episodes(
        catalogue.find(scenario or [PAPER]),
        list(dict.fromkeys(controller or _usable_controllers())),
        list(dict.fromkeys(rate)) if rate else None,
        list(dict.fromkeys(seed)) if seed else (range(1, seeds + 1) if seeds else None),
    )
    store.prepare()
    suite.prepare(chosen)
    records = _run_with_progress(chosen, workers or os.cpu_count() or 1, store)
    rows = leaderboard.rows(store.read())
    _write_leaderboard(rows, out)
    _print_leaderboard(rows, out)
    _report_failures(records)
    if any(record.status not in ("ok", "skipped") for record in records):
        raise typer.Exit(1)


def _usable_controllers() -> list[str]:
    """All installed controllers but those that cannot be loaded, which are named."""
    from benchmark import plugins
    from benchmark.errors import ControllerError

    usable = []
    for name in plugins.discovered():
        try:
            plugins.load(name)
        except ControllerError as error:
            _notice(f"{error}; left out")
        else:
            usable.append(name)
    return usable


def _run_with_progress(chosen: "Sequence[Episode]", workers: int, store: "Store") -> "list[Record]":
    from rich import progress

    from benchmark import suite

    records = []
    columns = (
        progress.TextColumn("{task.completed}/{task.total} episodes"),
        progress.BarColumn(),
        progress.TaskProgressColumn(),
        progress.TimeElapsedColumn(),
        progress.TextColumn("left"),
        progress.TimeRemainingColumn(),
    )
    try:
        with progress.Progress(*columns, console=_stderr()) as bar:
            task = bar.add_task("", total=len(chosen))
            for record in suite.run_all(chosen, workers):
                store.append(record)
                records.append(record)
                bar.advance(task)
    except KeyboardInterrupt:
        _notice(
            f"stopped; {len(records)} of {len(chosen)} records are in {store.records_folder}; "
            "a new run starts from the beginning"
        )
        raise
    return records


def _report_failures(records: "Sequence[Record]") -> None:
    """Name each kind of failure once, with an episode that shows it."""
    seen: dict[tuple[str, str, str], list[Record]] = {}
    for record in records:
        if record.status != "ok":
            key = (record.controller, record.status, record.reason or "")
            seen.setdefault(key, []).append(record)
    for (controller, status, reason), members in seen.items():
        one = members[0]
        _notice(
            f"{controller}: {len(members)} {status}, such as {one.scenario} "
            f"rate {one.rate} seed {one.seed}: {reason}"
        )
    refusals: dict[str, int] = {}
    for record in records:
        for junction in record.junctions.values():
            for reason in junction.refusals:
                kind = reason.rpartition(" (")[0]
                refusals[kind] = refusals.get(kind, 0) + 1
    for kind, episodes in refusals.items():
        _notice(f"{kind} (in {episodes} of {len(records)} episodes)")


def _notice(message: str) -> None:
    _stderr().print(f"[yellow]![/] {_literal(message)}", soft_wrap=True)


def _write_leaderboard(rows: "Sequence[Row]", out: Path) -> None:
    from benchmark import tables
    from benchmark.errors import StoreError

    try:
        (out / "LEADERBOARD.md").write_text(tables.markdown(rows), encoding="utf-8")
        (out / "leaderboard.csv").write_text(tables.as_csv(rows), encoding="utf-8")
    except OSError as error:
        raise StoreError(f"{out}: cannot write the leaderboard: {error.strerror}") from error


def _print_leaderboard(rows: "Sequence[Row]", out: Path) -> None:
    from benchmark import tables

    console = _stdout()
    for table in tables.terminal(rows, console.width):
        console.print(table)
        console.print()
    console.print(_literal(tables.legend()), soft_wrap=True)
    console.print(f"all figures: {out / 'LEADERBOARD.md'}", soft_wrap=True)


@app.command("leaderboard")
def leaderboard_(
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
) -> None:
    """Show the leaderboard of a results folder; needs no SUMO."""
    from benchmark import leaderboard, tables
    from benchmark.store import Store

    known = ("md", "csv", "json", "latex")
    if form is not None and form not in known:
        raise UsageError(f'--format "{form}": expected {", ".join(known)}')
    if rate is not None and form not in (None, "md"):
        raise UsageError("--rate makes a Markdown table; leave out --format, or give md")
    folder = records.parent if records.name == "records" else records
    rows = leaderboard.rows(Store(folder, notice=_notice).read())
    if rate is not None:
        if rate not in (known_rates := sorted({row.rate for row in rows if row.rate is not None})):
            raise UsageError(
                f"--rate {rate:g}: no records; expected one of {', '.join(map(str, known_rates))}"
            )
        typer.echo(tables.summary(rows, rate), nl=False)
    elif form is None:
        _print_leaderboard(rows, folder)
    else:
        typer.echo(tables.render(rows, form), nl=False)  # type: ignore[arg-type]


@app.command()
def capacity(
    records: Annotated[
        Path, typer.Option("--records", help="Results folder, or its records folder.")
    ] = Path("out"),
) -> None:
    """Show at which demand intersections jam, from runs of scenarios such as 334@700."""
    from benchmark import capacity
    from benchmark.store import Store

    folder = records.parent if records.name == "records" else records
    found = capacity.curves(Store(folder, notice=_notice).read())
    if not found:
        raise UsageError(
            f"{folder}: no records of scenarios at demands of their own; "
            "make some with `rightofway run 334@500 334@700 334@900`"
        )
    typer.echo(capacity.markdown(found), nl=False)


@app.command()
def watch(
    scenario: OneScenario,
    controller: Annotated[str, typer.Option(help="NAME or NAME?option=value.")],
    rate: Annotated[float, typer.Option(min=0, max=1, help="Penetration rate.")] = 0.5,
    seed: Annotated[int, typer.Option(min=0, max=LARGEST_SEED)] = 1,
) -> None:
    """Watch an episode in sumo-gui; needs a screen."""
    from benchmark import catalogue, episode

    one = catalogue.one(scenario)
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise UsageError("watch needs a screen, and neither DISPLAY nor WAYLAND_DISPLAY is set")
    record = episode.run(episode.Episode(one, controller, rate, seed), window=True)
    typer.echo(f"{record.status}{f': {record.reason}' if record.reason else ''}")
    if record.status not in ("ok", "skipped"):
        raise typer.Exit(1)


app.command()(command.train)


@app.command()
def schema() -> None:
    """Print the JSON Schema of scenario files, for editors."""
    from benchmark.scenario import json_schema

    typer.echo(json.dumps(json_schema(), indent=2))


if __name__ == "__main__":
    main()

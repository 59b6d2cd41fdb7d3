"""The command ``rightofway``: parses, calls, prints. Heavy imports wait inside the commands."""

import json
import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from baselines.paper.command import paper
from benchmark import __version__
from benchmark.commands import console
from benchmark.commands.check import check
from benchmark.commands.choice import LARGEST_SEED
from benchmark.commands.figures import draw_figures
from benchmark.commands.leaderboard import capacity, compact, leaderboard
from benchmark.commands.new import new
from benchmark.commands.reference import app as reference
from benchmark.commands.regress import regress
from benchmark.commands.replay import replay
from benchmark.commands.run import run
from benchmark.commands.site import serve, site
from benchmark.commands.submission import submit, verify
from benchmark.commands.train import train
from benchmark.plumbing.errors import RightOfWayError, UsageError

app = typer.Typer(
    name="rightofway",
    help="Benchmark suite for mixed-traffic control at intersections.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

OneScenario = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A file or a shipped name, such as 334.")
]


def main() -> None:
    """Run the command; errors a user can cause end in one message and exit code 2."""
    try:
        code = app(standalone_mode=False) or 0
    except RightOfWayError as error:
        code = _refused(str(error))
    except OSError as error:
        if error.errno is None:  # not the system's: a time-out, for one
            raise
        # what a command does not name itself: folders that cannot be read, a full disk behind >
        where = f"{error.filename}: " if error.filename else ""
        code = _refused(f"{where}{error.strerror}")
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


def _refused(words: str) -> int:
    """Say why; the exit code."""
    console.stderr().print(f"[bold red]error:[/] {console.literal(words)}", soft_wrap=True)
    return 2


def _version(wanted: bool) -> None:
    if wanted:
        from benchmark.sumo.tools import sumo_version

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
    """List the shipped scenarios and suites and the installed controllers."""
    from rich.table import Table

    from benchmark.control import plugins
    from benchmark.plumbing.errors import ControllerError
    from benchmark.scenario import catalogue, scenario
    from benchmark.study import suite

    scenarios = Table("scenario", "title", box=None)
    for name, path in catalogue.shipped().items():
        scenarios.add_row(name, console.literal(scenario.load(path).title))
    suites = Table("suite", "scenarios", "controllers", box=None)
    for column in suites.columns:
        column.overflow = "fold"  # references can be copied whole
    for name, path in suite.shipped().items():
        declared = suite.load(path)
        suites.add_row(
            name, *(", ".join(words) for words in (declared.scenarios, declared.controllers))
        )
    controllers = Table("controller", "rules", "description", "options", box=None)
    for name in plugins.discovered():
        try:
            kind = plugins.load(name)
        except ControllerError as error:
            controllers.add_row(name, "broken", console.literal(str(error)))
        else:
            words = plugins.description(kind), ", ".join(plugins.options(kind))
            controllers.add_row(name, kind.rules, *map(console.literal, words))
    for table in (scenarios, suites, controllers):
        console.stdout().print(table)


app.command()(check)


@app.command()
def show(
    scenario: OneScenario,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="PNG or SVG; default: SCENARIO.png here.")
    ] = None,
) -> None:
    """Draw an intersection: lanes, turns, zones, volumes and the signal program."""
    from benchmark.pictures.sheet import whole
    from benchmark.scenario import catalogue

    one = catalogue.one(scenario)
    target = output or Path(f"{one.name.replace('/', '-')}.png")
    whole.draw(one, target)
    typer.echo(str(target))


@app.command()
def signal(scenario: OneScenario) -> None:
    """Propose a signal program from the turning counts, by Webster's method.

    Without one a scenario takes it as it is: >> my.toml.
    """
    import tomli_w

    from benchmark.scenario import catalogue
    from benchmark.sumo import network, webster

    one = catalogue.one(scenario)
    if one.signal is not None:
        console.notice(f"{one.name}: has a signal program; take it out before you append this one")
    roads = network.build(one)
    proposed = webster.propose(one, roads)
    intersection = next(iter(roads.junctions.values())).intersection
    degrees = webster.degrees_of_saturation(one, intersection, proposed)
    worst = max(degrees, key=degrees.__getitem__)
    typer.echo(f"# {one.name}: cycle {proposed.cycle:g} s, Webster's method on the peak counts")
    typer.echo(f"# highest degree of saturation: {worst} {degrees[worst]:.2f}")
    document = proposed.model_dump(mode="json", exclude_defaults=True)
    typer.echo(tomli_w.dumps({"signal": {"kind": proposed.kind, **document}}), nl=False)


app.add_typer(new)
app.command()(run)
app.command()(leaderboard)
app.command("figures")(draw_figures)
app.command()(compact)
app.command()(capacity)
app.command()(paper)
app.command()(site)
app.command()(serve)
app.command()(regress)
app.add_typer(reference)
app.command()(replay)
app.command()(submit)
app.command()(verify)


@app.command()
def watch(
    scenario: OneScenario,
    controller: Annotated[str, typer.Option(help="NAME or file.py:Class; NAME?option=value.")],
    rate: Annotated[float, typer.Option(min=0, max=1, help="Penetration rate.")] = 0.5,
    seed: Annotated[int, typer.Option(min=0, max=LARGEST_SEED)] = 1,
) -> None:
    """Watch an episode in sumo-gui; needs a screen."""
    from benchmark.scenario import catalogue
    from benchmark.study import episode

    one = catalogue.one(scenario)
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise UsageError("watch needs a screen, and neither DISPLAY nor WAYLAND_DISPLAY is set")
    record = episode.run(episode.Episode(one, controller, rate, seed), window=True)
    typer.echo(f"{record.status}{f': {record.reason}' if record.reason else ''}")
    if record.status not in ("ok", "skipped"):
        raise typer.Exit(1)


app.command()(train)


@app.command()
def schema() -> None:
    """Print the JSON Schema of scenario files, for editors."""
    from benchmark.scenario.scenario import json_schema

    typer.echo(json.dumps(json_schema(), indent=2))


if __name__ == "__main__":
    main()

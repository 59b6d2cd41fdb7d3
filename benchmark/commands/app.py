"""The command ``rightofway``: gathers the subcommands; a user's mistake is one message."""

import sys
from typing import Annotated

import typer

from benchmark import __version__
from benchmark.commands import console
from benchmark.commands.check import check
from benchmark.commands.figures import draw_figures
from benchmark.commands.leaderboard import leaderboard
from benchmark.commands.list import list_installed
from benchmark.commands.new import new
from benchmark.commands.plugins import Commands
from benchmark.commands.records import compact, show_capacity
from benchmark.commands.reference import app as reference
from benchmark.commands.regress import regress
from benchmark.commands.renew import renew
from benchmark.commands.replay import replay
from benchmark.commands.run import run
from benchmark.commands.schema import schema
from benchmark.commands.show import show
from benchmark.commands.signal import signal
from benchmark.commands.site import serve, site
from benchmark.commands.submission import submit, verify
from benchmark.commands.train import train
from benchmark.commands.watch import watch
from benchmark.plumbing.errors import RightOfWayError
from benchmark.plumbing.words import in_our_words

app = typer.Typer(
    name="rightofway",
    cls=Commands,
    help="Benchmark suite for mixed-traffic control at intersections.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


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
        if isinstance(message := getattr(error, "message", None), str):
            error.message = in_our_words(message)  # type: ignore[attr-defined]
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


app.command("list")(list_installed)
app.command()(check)
app.command()(show)
app.command()(signal)
app.add_typer(new)
app.command()(run)
app.command()(leaderboard)
app.command("figures")(draw_figures)
app.command()(renew)
app.command()(compact)
app.command("capacity")(show_capacity)
app.command()(site)
app.command()(serve)
app.command()(regress)
app.add_typer(reference)
app.command()(replay)
app.command()(submit)
app.command()(verify)
app.command()(watch)
app.command()(train)
app.command()(schema)


if __name__ == "__main__":
    main()

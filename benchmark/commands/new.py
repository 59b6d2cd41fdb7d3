"""The commands ``rightofway new controller`` and ``rightofway new scenario``."""

from pathlib import Path
from typing import Annotated

import typer

new = typer.Typer(
    name="new", help="Write a new controller or scenario from a template.", no_args_is_help=True
)


@new.command()
def controller(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Such as my-controller.")],
) -> None:
    """Write a package with a controller that works, its tests and its CI, into ./NAME."""
    from benchmark.commands import scaffold

    made = scaffold.controller(name, Path())
    typer.echo(f"{made}/ is a package of its own; next:")
    typer.echo(f"  cd {made} && pip install -e '.[test]' && pytest")
    typer.echo(f"  rightofway check controller {name}")


@new.command()
def scenario(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Such as my-scenario.")],
) -> None:
    """Write a scenario with comments into ./NAME.toml."""
    from benchmark.commands import scaffold

    made = scaffold.scenario(name, Path())
    typer.echo(f"{made} is a scenario; next:")
    typer.echo(f"  rightofway check {made}")

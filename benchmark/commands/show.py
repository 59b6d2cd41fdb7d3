"""The command ``rightofway show``."""

from pathlib import Path
from typing import Annotated

import typer

from benchmark.commands.options import OneScenario


def show(
    scenario: OneScenario,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="PNG or SVG; default: SCENARIO.png here.")
    ] = None,
) -> None:
    """Draw an intersection: lanes, turns, zones, volumes and the signal program."""
    from benchmark.pictures.sheet import whole
    from benchmark.scenario import catalogue

    shown = catalogue.find_scenario(scenario)
    target = output or Path(f"{shown.name.replace('/', '-')}.png")
    whole.draw(shown, target)
    typer.echo(str(target))

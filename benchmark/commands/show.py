"""The command ``rightofway show``."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands.options import OneScenario
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.scenario.scenario import Scenario
    from benchmark.scenario.signal import Signal


def show(
    scenario: OneScenario,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="PNG or SVG; default: SCENARIO.png here.")
    ] = None,
    controller: Annotated[
        str | None,
        typer.Option(
            help="Whose signal program is drawn, such as traffic-light-webster; default: the "
            "scenario's own."
        ),
    ] = None,
) -> None:
    """Draw an intersection: lanes, turns, zones, volumes and the signal program."""
    from benchmark.pictures.sheet import whole
    from benchmark.scenario import catalogue

    shown = catalogue.find_scenario(scenario)
    if controller:
        shown = shown.with_programs(_programs(controller, shown))
    target = output or Path(f"{shown.name.replace('/', '-')}.png")
    whole.draw(shown, target)
    typer.echo(str(target))


def _programs(controller: str, scenario: "Scenario") -> "Mapping[str, Signal]":
    """The signal programs that a controller runs on a scenario, by junction."""
    from benchmark.control import plugins
    from benchmark.control.guard import Local

    decider = Local(plugins.find_controller(controller)).decider(scenario)
    if reason := decider.unsupported:
        raise UsageError(f"{controller}: {reason}")
    if not decider.programs:
        raise UsageError(
            f"{controller}: shows no signal program; expected one that does, such as traffic-light"
        )
    return decider.programs

"""The command ``rightofway watch``."""

import os
import sys
from typing import Annotated

import typer

from benchmark.commands.options import LARGEST_SEED, OneScenario
from benchmark.plumbing.errors import UsageError


def watch(
    scenario: OneScenario,
    controller: Annotated[str, typer.Option(help="NAME or file.py:Class; NAME?option=value.")],
    rate: Annotated[float, typer.Option(min=0, max=1, help="Penetration rate.")] = 0.5,
    seed: Annotated[int, typer.Option(min=0, max=LARGEST_SEED)] = 1,
) -> None:
    """Watch an episode in sumo-gui; needs a screen."""
    from benchmark.scenario import catalogue
    from benchmark.study import episode

    watched = episode.Episode(catalogue.find_scenario(scenario), controller, rate, seed)
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise UsageError("watch needs a screen, and neither DISPLAY nor WAYLAND_DISPLAY is set")
    record = episode.run_episode(watched, episode.Audience(window=True))
    typer.echo(f"{record.status}{f': {record.reason}' if record.reason else ''}")
    if record.status not in ("ok", "skipped"):
        raise typer.Exit(1)

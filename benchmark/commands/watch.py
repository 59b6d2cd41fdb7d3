"""The command ``rightofway watch``."""

import os
import socket
import sys
from typing import Annotated

import typer

from benchmark.commands.options import LARGEST_SEED, OneScenario, rate_option
from benchmark.plumbing.errors import UsageError


def watch(
    scenario: OneScenario,
    controller: Annotated[str, typer.Option(help="NAME or file.py:Class; NAME?option=value.")],
    rate: Annotated[float, rate_option(words="Penetration rate.")] = 0.5,
    seed: Annotated[int, typer.Option(min=0, max=LARGEST_SEED)] = 1,
) -> None:
    """Watch an episode in sumo-gui; needs a screen."""
    from benchmark.scenario import catalogue
    from benchmark.study import episode

    watched = episode.Episode(catalogue.find_scenario(scenario), controller, rate, seed)
    if sys.platform == "linux":
        _require_screen(os.environ.get("DISPLAY"), os.environ.get("WAYLAND_DISPLAY"))
    record = episode.run_episode(watched, episode.Audience(window=True))
    typer.echo(f"{record.status}{f': {record.reason}' if record.reason else ''}")
    if record.status not in ("ok", "skipped"):
        raise typer.Exit(1)


PATIENCE = 3.0  # s, for a display to answer


def _require_screen(display: str | None, wayland: str | None) -> None:
    """Say at once that nothing can be shown; sumo-gui would try for a minute.

    Raises:
        UsageError: there is no display, or none that answers.
    """
    if not (display or wayland):
        raise UsageError("watch needs a screen, and neither DISPLAY nor WAYLAND_DISPLAY is set")
    if display and not any(map(_answers, _doors(display))):
        raise UsageError(
            f'watch needs a screen, and none answers at DISPLAY "{display}"; log in with a screen '
            "(over ssh with -X), or make a page with `rightofway replay`"
        )


Door = tuple[int, str | tuple[str, int]]
"""A family of sockets and an address."""


def _doors(display: str) -> list[Door]:
    """Where an X server of this name would listen, as in ``:0``, ``host:1`` and ``:0.1``."""
    host, colon, number = display.rpartition(":")
    screen = number.partition(".")[0]
    if not colon or not screen.isdigit():
        return []
    path = f"/tmp/.X11-unix/X{screen}"  # noqa: S108 - where X servers listen
    local: list[Door] = [(socket.AF_UNIX, path), (socket.AF_UNIX, f"\0{path}")]
    return local if host in ("", "unix") else [(socket.AF_INET, (host, 6000 + int(screen)))]


def _answers(door: Door) -> bool:
    family, address = door
    with socket.socket(family, socket.SOCK_STREAM) as trial:
        trial.settimeout(PATIENCE)
        try:
            trial.connect(address)
        except (OSError, OverflowError):
            return False
    return True

"""The episodes that a command's options ask for."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.commands import console
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.plumbing.errors import ScenarioError, UsageError

if TYPE_CHECKING:
    from benchmark.study.episode import Episode

LARGEST_SEED = 2**31 - 1  # of SUMO
PAPER = "colorado-springs"


def choose(
    references: Sequence[str],
    controllers: Sequence[str],
    rates: Sequence[float],
    seeds: Sequence[int],
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
) -> "list[Episode]":
    """The episodes that were asked for; what was left open is the suite's, or the default."""
    from benchmark.scenario import catalogue
    from benchmark.study import episodes
    from benchmark.study import suite as suite_file

    declared = suite_file.find(references)
    if declared is None:
        try:
            scenarios = catalogue.find(references, also=suite_file.shipped())
        except ScenarioError:
            _name_slips(references)
            raise
        controllers = controllers or _usable_controllers(isolate, limits)
    else:
        scenarios = declared.load_scenarios()
        controllers = controllers or declared.checked_controllers(isolate, limits)
        rates = rates or declared.rates or ()
        seeds = seeds or range(1, (declared.seeds or 0) + 1)
    once = dict.fromkeys
    return episodes.episodes(
        scenarios,
        list(once(controllers)),
        list(once(rates)) or None,
        list(once(seeds)) or None,
        isolate=isolate,
        limits=limits,
    )


def _name_slips(references: Sequence[str]) -> None:
    """Values of an option that stand where scenarios do deserve words of their own.

    Raises:
        UsageError: there is one.
    """
    from benchmark.control import plugins

    for one in references:
        if Path(one).exists():
            continue
        if one.partition("?")[0] in plugins.discovered():
            raise UsageError(f'"{one}" is a controller, not a scenario')
        if re.fullmatch(r"[01]?\.\d+|[01]", one):
            raise UsageError(f'"{one}" is a rate, not a scenario; give each as --rate {one}')


def _usable_controllers(isolate: bool | None, limits: Limits) -> list[str]:
    """All installed controllers but those that cannot be loaded, which are named."""
    from benchmark.control import plugins
    from benchmark.control.isolation.remote import look
    from benchmark.plumbing.errors import ControllerError

    usable = []
    for name in plugins.discovered():
        try:
            look(name, isolate, limits)
        except ControllerError as error:
            console.notice(f"{error}; left out")
        else:
            usable.append(name)
    return usable

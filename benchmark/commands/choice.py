"""The episodes and the suite that a command's options name; likely slips have their messages."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.commands import console
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.plumbing.errors import ScenarioError, UsageError

if TYPE_CHECKING:
    from benchmark.study.episode import Episode
    from benchmark.study.suite import Suite

PAPER = "colorado-springs"


def choose(
    references: Sequence[str] | None,
    controllers: Sequence[str] | None,
    rates: Sequence[float] | None,
    seeds: Sequence[int],
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
) -> "list[Episode]":
    """As ``benchmark.study.episodes.choose_episodes``; without scenarios, the paper's.

    Raises:
        UsageError: values of an option stand where scenarios do.
    """
    from benchmark.study.episodes import choose_episodes

    references = references or [PAPER]
    try:
        return choose_episodes(
            references,
            controllers or (),
            rates or (),
            seeds,
            isolate=isolate,
            limits=limits,
            notice=console.notice,
        )
    except ScenarioError:
        _name_slips(references)
        raise


def _name_slips(references: Sequence[str]) -> None:
    from benchmark.control import plugins

    for word in references:
        if Path(word).exists():
            continue
        if word.partition("?")[0] in plugins.discovered():
            raise UsageError(f'"{word}" is a controller, not a scenario')
        if re.fullmatch(r"[01]?\.\d+|[01]", word):
            raise UsageError(f'"{word}" is a rate, not a scenario; give each as --rate {word}')


def suite_named(name: str) -> "Suite":
    """The suite of that name, or in that file.

    Raises:
        UsageError: there is none.
        SuiteError: it is not valid.
    """
    from benchmark.plumbing.messages import nearest
    from benchmark.study.suite import find_suite, load_suite, shipped_suites

    if (suite := find_suite([name])) is not None:
        return suite
    if Path(name).is_file():
        return load_suite(Path(name))  # says what is wrong with it
    raise UsageError(
        f'--suite "{name}": neither a file nor shipped{nearest(name, shipped_suites())}'
    )

"""Suites that a command's option names."""

from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.study.episode import Episode
    from benchmark.study.suite import Suite


def find(name: str) -> "Suite":
    """The suite of that name, or in that file.

    Raises:
        UsageError: there is none.
        SuiteError: it is not valid.
    """
    from benchmark.plumbing.messages import nearest
    from benchmark.study import suite as suite_file

    found = suite_file.find([name])
    if found is None and Path(name).is_file():
        found = suite_file.load(Path(name))  # says what is wrong with it
    if found is None:
        raise UsageError(
            f'--suite "{name}": neither a file nor shipped{nearest(name, suite_file.shipped())}'
        )
    return found


def episodes_of(declared: "Suite") -> "list[Episode]":
    """All episodes of a suite.

    Raises:
        SuiteError: a scenario or controller is not there.
    """
    from benchmark.study import episodes

    return episodes.episodes(
        declared.load_scenarios(),
        declared.checked_controllers(),
        declared.rates,
        range(1, declared.seeds + 1) if declared.seeds else None,
    )

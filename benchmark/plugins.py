"""How controllers and their trainers are found: two groups of entry points."""

from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from benchmark.controller import Controller
from benchmark.errors import ControllerError
from benchmark.validation import nearest

GROUP = "rightofway.controllers"
TRAINERS = "rightofway.trainers"
CHOICES = {"rules": ("signals", "robot vehicles"), "arbitration": ("flexible", "own")}


@cache
def discovered() -> dict[str, EntryPoint]:
    """All installed controllers by name, sorted."""
    return {entry.name: entry for entry in sorted(entry_points(group=GROUP), key=lambda e: e.name)}


def load(name: str) -> type[Controller]:
    """The class of an installed controller.

    Raises:
        ControllerError: there is none of that name, it cannot be imported, or it is no controller.
    """
    if (entry := discovered().get(name)) is None:
        raise ControllerError(f'unknown controller "{name}"{nearest(name, discovered())}')
    try:
        found = entry.load()
    except (Exception, SystemExit) as error:  # whatever a plugin does on import
        raise ControllerError(
            f'controller "{name}" ({entry.value}) cannot be imported: '
            f"{type(error).__name__}: {error}"
        ) from error
    if not (isinstance(found, type) and issubclass(found, Controller)):
        raise ControllerError(
            f'controller "{name}" ({entry.value}) is not a benchmark.controller.Controller'
        )
    for key, choices in CHOICES.items():
        if (value := getattr(found, key)) not in choices:
            raise ControllerError(
                f'controller "{name}" ({entry.value}): {key} = {value!r}; '
                f'expected "{choices[0]}" or "{choices[1]}"'
            )
    return found


def load_trainer(name: str) -> Callable[[Any], None]:
    """What trains a controller: a function of ``benchmark.learning.run.Options``.

    Raises:
        ControllerError: there is none of that name, or what it needs is not installed.
    """
    known = {entry.name: entry for entry in entry_points(group=TRAINERS)}
    if (entry := known.get(name)) is None:
        raise ControllerError(f'nothing trains "{name}"{nearest(name, sorted(known))}')
    try:
        trainer: Callable[[Any], None] = entry.load()
    except ModuleNotFoundError as error:
        raise ControllerError(
            f'training "{name}" needs {error.name}, which is not installed; '
            "pip install 'rightofway[train]'"
        ) from error
    return trainer


def description(controller: type[Controller]) -> str:
    """The first line of a controller's docstring."""
    return (controller.__doc__ or "").strip().partition("\n")[0]


def provenance(name: str) -> str:
    """The distribution a controller comes from, with its version, as in ``rightofway 0.1.0``."""
    distribution = discovered()[name].dist
    return f"{distribution.name} {distribution.version}" if distribution else "unknown"

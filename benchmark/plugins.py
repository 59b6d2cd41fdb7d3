"""How controllers and their trainers are found: two groups of entry points.

A reference names a controller and may give options, as in ``virtual-signal?green=15&clearance=4``:
the keyword arguments of its constructor.
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any
from urllib.parse import parse_qsl

from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from benchmark.controller import Controller
from benchmark.errors import ControllerError
from benchmark.validation import explain, nearest

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


@dataclass(frozen=True)
class Plugin:
    """A controller as it is to be run: its class and its options."""

    reference: str  # as in records and tables: options sorted by name
    kind: type[Controller]
    options: Mapping[str, object] = field(default_factory=dict)

    def new(self) -> Controller:
        """Another controller of this kind."""
        return self.kind(**self.options)


def find(reference: str) -> Plugin:
    """The controller that a reference names, with its options.

    Raises:
        ControllerError: as ``load``; an option is unknown, given twice or has a wrong value.
    """
    name, _, query = reference.partition("?")
    kind = load(name)
    if not query:
        return Plugin(name, kind)
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=True)
    except ValueError as error:
        raise ControllerError(
            f'"{reference}": expected options as in {name}?first=1&second=2'
        ) from error
    given = dict(sorted(pairs))
    if len(given) < len(pairs):
        raise ControllerError(f'"{reference}": an option is given twice')
    known = _options(kind)
    try:
        checked = known.model_validate(given)
    except ValidationError as error:
        raise ControllerError(explain(error, known, f'"{reference}"')) from error
    options = {key: getattr(checked, key) for key in given}
    written = "&".join(f"{key}={_text(value)}" for key, value in options.items())
    return Plugin(f"{name}?{written}", kind, options)


def _text(value: object) -> str:
    """An option's value in one spelling: 4 for 4.0, true for True."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(value).removesuffix(".0") if isinstance(value, float) else str(value)


def _options(kind: type[Controller]) -> type[BaseModel]:
    """What a controller's constructor takes."""
    parameters = list(inspect.signature(kind.__init__, eval_str=True).parameters.values())[1:]
    named = [one for one in parameters if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY)]
    fields: dict[str, Any] = {
        one.name: (Any if one.annotation is one.empty else one.annotation, one.default)
        for one in named
    }
    return create_model(
        "Options", __config__=ConfigDict(extra="forbid", allow_inf_nan=False), **fields
    )


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


def provenance(reference: str) -> str:
    """The distribution a controller comes from, with its version, as in ``rightofway 0.1.0``."""
    distribution = discovered()[reference.partition("?")[0]].dist
    return f"{distribution.name} {distribution.version}" if distribution else "unknown"

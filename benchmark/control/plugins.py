"""How controllers are found: installed, in a file, or in a module.

``find_controller`` is the one door: it takes any reference of ``benchmark.control.reference`` and
checks its options against the constructor's signature.
"""

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from benchmark.control import declarations, loading
from benchmark.control import reference as naming
from benchmark.control.controller import Controller
from benchmark.control.declarations import Declaration
from benchmark.control.reference import Reference
from benchmark.plumbing.errors import ControllerError
from benchmark.plumbing.messages import explain, nearest

GROUP = "rightofway.controllers"


@dataclass(frozen=True)
class Plugin:
    """A controller as it is to be run: its class and its options."""

    reference: str  # as ``find_controller`` reads it anywhere: files absolute, options sorted
    kind: type[Controller]
    options: Mapping[str, object] = field(default_factory=dict)

    @property
    def declaration(self) -> Declaration:
        """What its class says of itself."""
        return Declaration.of(self.reference, self.kind)

    @property
    def label(self) -> str:
        """The reference as records and tables have it: a file by its name alone."""
        return naming.label(self.reference)

    def new(self) -> Controller:
        """Another controller of this kind."""
        return self.kind(**self.options)


@cache
def discovered() -> dict[str, EntryPoint]:
    """All installed controllers by name, sorted."""
    return {entry.name: entry for entry in sorted(entry_points(group=GROUP), key=lambda e: e.name)}


def find_controller(text: str, folder: Path = Path()) -> Plugin:
    """The controller that a reference names, with its options.

    Args:
        text: an installed controller's name, ``path/to/file.py:Class`` or
            ``package.module:Class``, and options behind a ``?``.
        folder: where a file's relative path begins.

    Raises:
        ControllerError: as ``load_class``; an option is unknown, missing, given twice or has a
            wrong value.
    """
    parts = naming.parse(text).placed(folder)
    kind = load_class(parts.name)
    options = _checked_options(parts, kind)
    return Plugin(str(replace(parts, query=naming.query(options))), kind, options)


def load_class(name: str) -> type[Controller]:
    """The class that a reference without options names.

    Raises:
        ControllerError: there is none of that name, it cannot be imported, or it is no controller.
    """
    parts = naming.parse(name)
    if parts.is_file:
        kind = loading.from_file(Path(parts.place), parts.attribute)
    elif parts.attribute:
        kind = loading.from_module(parts.place, parts.attribute)
    elif (entry := discovered().get(name)) is not None:
        kind = loading.from_entry_point(entry)
        return _checked(kind, f'controller "{name}" ({entry.value})')
    else:
        raise ControllerError(f'unknown controller "{name}"{nearest(name, discovered())}')
    return _checked(kind, f'controller "{parts.label}"')


def _checked(kind: object, title: str) -> type[Controller]:
    """A class that keeps to the contract as far as can be seen without running it."""
    if not (isinstance(kind, type) and issubclass(kind, Controller)):
        raise ControllerError(f"{title} is not a benchmark.control.controller.Controller")
    if missing := sorted(getattr(kind, "__abstractmethods__", ())):
        raise ControllerError(f"{title} lacks {' and '.join(missing)}")
    if problem := declarations.mistake(kind):
        raise ControllerError(f"{title}: {problem}")
    return kind


def _checked_options(parts: Reference, kind: type[Controller]) -> dict[str, object]:
    """The options that a reference gives, as its constructor takes them."""
    given, title = parts.options(), f'"{parts.label}"'
    if not given and all(option.default is not option.empty for option in _parameters(kind)):
        return {}
    try:
        known = _options(kind)
    except NameError as error:  # an annotation names what is imported for type checkers only
        raise ControllerError(f"{title}: its constructor's annotations: {error}") from error
    try:
        checked = known.model_validate(given)
    except ValidationError as error:
        raise ControllerError(explain(error, known, title)) from error
    return {key: getattr(checked, f"option_{key}") for key in given}


def options(kind: type[Controller]) -> list[str]:
    """The names of a controller's options."""
    return [option.name for option in _parameters(kind)]


def _parameters(kind: type[Controller], *, eval_str: bool = False) -> list[inspect.Parameter]:
    """What a controller's constructor takes by name."""
    parameters = list(inspect.signature(kind.__init__, eval_str=eval_str).parameters.values())[1:]
    by_name = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return [parameter for parameter in parameters if parameter.kind in by_name]


def _options(kind: type[Controller]) -> type[BaseModel]:
    """A table of what a controller's constructor takes."""
    fields: dict[str, Any] = {
        f"option_{option.name}": (  # a prefix, as some names mean something to pydantic
            Any if option.annotation is option.empty else option.annotation,
            Field(... if option.default is option.empty else option.default, alias=option.name),
        )
        for option in _parameters(kind, eval_str=True)
    }
    config = ConfigDict(extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True)
    return create_model("Options", __config__=config, **fields)


def description(controller: type[Controller]) -> str:
    """The first line of a controller's docstring."""
    return (controller.__doc__ or "").strip().partition("\n")[0]


def provenance(text: str) -> str:
    """Where a controller comes from, for the record.

    The distribution with its version, as in ``rightofway 0.1.0``; of a file its name and SHA-256.
    """
    parts = naming.parse(text).placed(Path())
    if parts.is_file:
        return loading.origin_of_file(Path(parts.place))
    if parts.attribute:
        return loading.origin_of_module(parts.place)
    entry = discovered().get(parts.place)
    return _distribution(entry) if entry else "unknown"


@cache
def _distribution(entry: EntryPoint) -> str:
    """An entry point's distribution with its version."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "unknown"

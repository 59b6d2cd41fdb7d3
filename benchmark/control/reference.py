"""How a controller is written: an installed name, a class in a file or in a module, and options.

``virtual-signal?green=15&clearance=4``, ``path/to/file.py:MyController`` and
``package.module:MyController`` are references; in TOML a table with a ``name`` is one as well.
Only text is handled here; ``benchmark.control.plugins.find_controller`` leads to the class.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import parse_qsl, quote

from benchmark.plumbing.errors import ControllerError

FILE = re.compile(r"(?P<place>[^?]+?\.py):(?P<attribute>[^?]*)(\?(?P<query>.*))?")
DOTTED = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")
PLAIN = "-._~/:,+"  # what stands in an option's value as it is
FORMS = "NAME, path/to/file.py:Class or package.module:Class"


@dataclass(frozen=True)
class Reference:
    """A reference in its parts."""

    place: str  # an installed controller's name, a file's path or a module's name
    attribute: str = ""  # the class in the file or module; empty for an installed controller
    query: str = ""  # the options, as in "green=15&clearance=4"

    @property
    def is_file(self) -> bool:
        """Whether it names a class in a file."""
        return bool(self.attribute) and self.place.endswith(".py")

    @property
    def name(self) -> str:
        """The reference without its options."""
        return f"{self.place}:{self.attribute}" if self.attribute else self.place

    @property
    def label(self) -> str:
        """The reference as records and tables have it, wherever the file lies."""
        place = re.split(r"[/\\]", self.place)[-1] if self.is_file else self.place
        return str(replace(self, place=place))

    def __str__(self) -> str:
        return f"{self.name}?{self.query}" if self.query else self.name

    def placed(self, folder: Path) -> "Reference":
        """The reference as seen from anywhere, if its file was given relative to a folder."""
        if not self.is_file:
            return self
        return replace(self, place=os.path.abspath(folder / Path(self.place).expanduser()))  # noqa: PTH100 - a link keeps its name

    def options(self) -> dict[str, str]:
        """The options by name, sorted.

        Raises:
            ControllerError: they are not written as options, or one is given twice.
        """
        if not self.query:
            return {}
        try:
            pairs = parse_qsl(
                self.query.replace("+", "%2B"), keep_blank_values=True, strict_parsing=True
            )
        except ValueError as error:
            raise ControllerError(
                f'"{self}": expected options as in {self.name}?first=1&second=2'
            ) from error
        given = dict(sorted(pairs))
        if len(given) < len(pairs):
            raise ControllerError(f'"{self}": an option is given twice')
        return given


def parse(text: str) -> Reference:
    """Take a reference apart.

    Raises:
        ControllerError: it has none of the three forms.
    """
    if found := FILE.fullmatch(text):
        reference = Reference(found["place"], found["attribute"], found["query"] or "")
    else:
        head, _, query = text.partition("?")
        place, colon, attribute = head.partition(":")
        if place.endswith(".py"):
            raise ControllerError(f'"{text}": which class? Expected {place}:MyController')
        if not place or (colon and not DOTTED.fullmatch(place)):
            raise ControllerError(f'"{text}" names no controller; expected {FORMS}')
        reference = Reference(place, attribute, query)
        if not colon:
            return reference
    if not DOTTED.fullmatch(reference.attribute):
        raise ControllerError(
            f'"{text}": "{reference.attribute}" cannot be a class; expected '
            f"{reference.place}:MyController"
        )
    return reference


def label(text: str) -> str:
    """A reference as records and tables have it: the same wherever its file lies."""
    return parse(text).label


def query(options: Mapping[str, object]) -> str:
    """Options as they stand behind a ``?``, each value in one spelling."""
    return "&".join(f"{key}={quote(_text(value), safe=PLAIN)}" for key, value in options.items())


def _text(value: object) -> str:
    """An option's value in one spelling: 4 for 4.0, true for True."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(value).removesuffix(".0") if isinstance(value, float) else str(value)


def from_table(table: Mapping[str, object]) -> str:
    """The reference that a TOML table stands for: its ``name`` and, as options, all else.

    Raises:
        ControllerError: there is no name, it has options already, or a value is no plain one.
    """
    name, options = table.get("name"), {k: v for k, v in table.items() if k != "name"}
    if not isinstance(name, str):
        raise ControllerError('expected a table such as { name = "virtual-signal", clearance = 4 }')
    if "?" in name:
        raise ControllerError(f'"{name}": in a table options are keys, and the name has none')
    for key, value in options.items():
        if not isinstance(value, str | bool | int | float):
            raise ControllerError(f"{key}: expected a number, a text, true or false; got {value!r}")
    return str(replace(parse(name), query=query(options)))


def place(scenario: str, rate: float | None, seed: int | None = None) -> str:
    """Where an episode, or a cell, is, in words; without a rate it is at every rate."""
    parts = [scenario]
    parts += [] if rate is None else [f"rate {rate:g}"]
    parts += [] if seed is None else [f"seed {seed}"]
    return " ".join(parts)

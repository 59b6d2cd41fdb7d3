"""Commands in writing: how they travel from an isolated controller, and stand in an action log.

They are written as they were given, illegal ones too, so that the same rules refuse the same ones
with the same words when they are read again.
"""

import math
from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Annotated, Any, NamedTuple

from msgspec import Meta

from benchmark.control.controller import Command, Drive, Go, Phase, Stop

NO_SIDE = 2  # stands for a lane change that is none of -1, 0 and 1
Name = Annotated[str, Meta(max_length=200)]


class Written(NamedTuple):
    """One command as it was given."""

    target: Name | None  # None: it was no text, and so nobody's id
    command: Name  # "go", "stop", "drive", "phase"; "other" for what is no command
    acceleration: float | None = None  # m/s2, of a drive; NaN for what is no finite number
    lane_change: int | None = None  # of a drive; NO_SIDE for what is no lane change
    name: Name | None = None  # of the phase, or of the type of what is no command


def write_command(target: object, command: object) -> Written:
    """A command in writing."""
    who = text(target) if isinstance(target, str) else None
    kind = type(command)
    if kind is Go:
        return Written(who, "go")
    if kind is Stop:
        return Written(who, "stop")
    if isinstance(command, Drive) and kind is Drive:
        return Written(who, "drive", _number(command.acceleration), _side(command.lane_change))
    if isinstance(command, Phase) and kind is Phase:
        return Written(who, "phase", name=text(str(command.name)))
    return Written(who, "other", name=text(kind.__name__))


def read_commands(lines: Iterable[Written]) -> Mapping[Any, Command]:
    """The answer that commands were, as the rules are to judge it."""
    return {object() if line.target is None else line.target: _command(line) for line in lines}


def text(words: str) -> str:
    """Text that UTF-8 can hold."""
    return words.encode(errors="replace").decode()


def _command(line: Written) -> Any:
    if line.command == "go":
        return Go()
    if line.command == "stop":
        return Stop()
    if line.command == "drive":
        acceleration = math.nan if line.acceleration is None else line.acceleration
        return Drive(acceleration, line.lane_change)  # type: ignore[arg-type]
    if line.command == "phase":
        return Phase(line.name or "")
    return type(line.name or "", (), {})()  # the rules name the type in their refusal


def _number(value: object) -> float:
    try:
        return float(value) if isinstance(value, Real) and math.isfinite(value) else math.nan
    except OverflowError:  # a whole number beyond all floats
        return math.nan


def _side(value: Any) -> int:
    try:
        return int(value) if value in (-1, 0, 1) else NO_SIDE
    except Exception:  # whatever a controller put there
        return NO_SIDE

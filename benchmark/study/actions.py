"""What a controller commanded, as plain rows; and a controller that commands it again.

Commands are kept as they were given, illegal ones too, so that the same rules refuse the same ones
with the same words when they are given again.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import Any, ClassVar, NamedTuple

from benchmark.control.controller import Command, Controller, Drive, Go, Phase, Stop
from benchmark.control.intersection import Intersection
from benchmark.control.plugins import Plugin
from benchmark.control.state import TrafficState
from benchmark.records.record import Record
from benchmark.scenario.layout import Signal
from benchmark.scenario.scenario import Scenario

NO_SIDE = 2  # stands for a lane change that is none of -1, 0 and 1


class Action(NamedTuple):
    """One command as it was given."""

    step: int  # 0 for the episode's first
    junction: str
    target: str | None  # None: it was no text, and so nobody's id
    command: str  # "go", "stop", "drive", "phase"; "other" for what is no command
    acceleration: float | None  # m/s2, of a drive; NaN for what is no finite number
    lane_change: int | None  # of a drive; NO_SIDE for what is no lane change
    name: str | None  # of the phase, or of the type of what is no command


class Recording:
    """Keeps what the controllers of an episode command; ``listener`` is told of each answer."""

    def __init__(self) -> None:
        self.signal: Signal | None = None
        self.actions: list[Action] = []
        self._steps: dict[str, int] = {}

    def listener(self, junction: str) -> Callable[[Mapping[str, Command]], None]:
        """What is to be called with the answer of every step at a junction."""
        self._steps[junction] = 0

        def hear(commands: Mapping[str, Command]) -> None:
            step = self._steps[junction]
            self._steps[junction] += 1
            self.actions.extend(
                _action(step, junction, target, command) for target, command in commands.items()
            )

        return hear


def _action(step: int, junction: str, target: object, command: object) -> Action:
    who = _text(target) if isinstance(target, str) else None
    kind = type(command)
    if kind is Go:
        return Action(step, junction, who, "go", None, None, None)
    if kind is Stop:
        return Action(step, junction, who, "stop", None, None, None)
    if isinstance(command, Drive) and kind is Drive:
        speeding, side = _number(command.acceleration), _side(command.lane_change)
        return Action(step, junction, who, "drive", speeding, side, None)
    if isinstance(command, Phase) and kind is Phase:
        return Action(step, junction, who, "phase", None, None, _text(str(command.name)))
    return Action(step, junction, who, "other", None, None, _text(kind.__name__))


def _text(text: str) -> str:
    """Text that UTF-8 can hold."""
    return text.encode(errors="replace").decode()


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


def _command(action: Action) -> Any:
    """The command of an action, as the rules are to judge it."""
    if action.command == "go":
        return Go()
    if action.command == "stop":
        return Stop()
    if action.command == "drive":
        assert action.acceleration is not None
        return Drive(action.acceleration, action.lane_change)  # type: ignore[arg-type]
    if action.command == "phase":
        return Phase(action.name or "")
    return type(action.name or "", (), {})()  # the rules name the type in their refusal


class Spoken(Controller):
    """Commands what was commanded before, step by step, whatever it sees.

    Args:
        actions: of a whole episode, in the order in which they were given.
        record: what is known of the controller that gave them.
        program: of the lights, where signals ruled.
    """

    def __init__(self, actions: Sequence[Action], record: Record, program: Signal | None) -> None:
        self.weights_hash, self.trained_on = record.weights_hash, record.trained_on
        self._actions, self._program = actions, program

    def supports(self, scenario: Scenario) -> None:
        """It ran there once."""

    def signal(self, scenario: Scenario) -> Signal | None:
        """The program that ran."""
        return self._program

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Begin anew."""
        self._step = 0
        self._given: dict[int, dict[Any, Command]] = {}
        for action in self._actions:
            if action.junction == intersection.id:
                target = object() if action.target is None else action.target
                self._given.setdefault(action.step, {})[target] = _command(action)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """The commands of this step."""
        commands = self._given.get(self._step, {})
        self._step += 1
        return commands


def spoken(actions: Sequence[Action], record: Record, program: Signal | None) -> Plugin:
    """What stands in for the controller of a record."""

    class Same(Spoken):
        rules: ClassVar = record.rules or "robot vehicles"
        arbitration: ClassVar = record.arbitration or "flexible"
        needs_robot_vehicles: ClassVar = record.rate is not None

    options = {"actions": actions, "record": record, "program": program}
    return Plugin(record.controller, Same, options)

"""What a controller commanded, as plain rows; and a controller that commands it again."""

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, NamedTuple

from benchmark.control.commands import Written, read_commands, write_command
from benchmark.control.controller import Command, Controller
from benchmark.control.intersection import Intersection
from benchmark.control.plugins import Plugin
from benchmark.control.state import TrafficState
from benchmark.records.record import Record
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal


class Action(NamedTuple):
    """One command as it was given; behind the junction stand the fields of ``Written``."""

    step: int  # 0 for the episode's first
    junction: str
    target: str | None
    command: str
    acceleration: float | None  # m/s2
    lane_change: int | None
    name: str | None

    @property
    def written(self) -> Written:
        """The command in writing."""
        return Written(*self[2:])


class Recording:
    """Keeps what the controllers of an episode command; ``listener`` is told of each answer."""

    def __init__(self) -> None:
        self.programs: Mapping[str, Signal] = {}
        self.actions: list[Action] = []
        self._steps: dict[str, int] = {}

    def listener(self, junction: str) -> Callable[[Mapping[str, Command]], None]:
        """What is to be called with the answer of every step at a junction."""
        self._steps[junction] = 0

        def hear(commands: Mapping[str, Command]) -> None:
            step = self._steps[junction]
            self._steps[junction] += 1
            self.actions.extend(
                Action(step, junction, *write_command(target, command))
                for target, command in commands.items()
            )

        return hear


class Spoken(Controller):
    """Commands what was commanded before, step by step, whatever it sees.

    Args:
        actions: of a whole episode, in the order in which they were given.
        record: what is known of the controller that gave them.
        programs: of the lights by junction, where signals ruled.
    """

    def __init__(
        self, actions: Sequence[Action], record: Record, programs: Mapping[str, Signal]
    ) -> None:
        self.weights_hash, self.trained_on = record.weights_hash, record.trained_on
        self._actions, self._programs = actions, programs

    def supports(self, scenario: Scenario) -> None:
        """It ran there once."""

    def signal(self, scenario: Scenario, junction: str) -> Signal | None:
        """The program that ran."""
        return self._programs.get(junction)

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Begin anew."""
        self._step = 0
        steps: dict[int, list[Written]] = {}
        for action in self._actions:
            if action.junction == intersection.id:
                steps.setdefault(action.step, []).append(action.written)
        self._given = {step: read_commands(lines) for step, lines in steps.items()}

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """The commands of this step."""
        commands = self._given.get(self._step, {})
        self._step += 1
        return commands


def spoken(actions: Sequence[Action], record: Record, programs: Mapping[str, Signal]) -> Plugin:
    """What stands in for the controller of a record."""

    class Same(Spoken):
        rules: ClassVar = record.rules or "robot vehicles"
        arbitration: ClassVar = record.arbitration or "flexible"
        needs_robot_vehicles: ClassVar = record.rate is not None

    options = {"actions": actions, "record": record, "programs": programs}
    return Plugin(record.controller, Same, options)

"""Calls controllers so that whatever they do costs only their own episode."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol, TypeVar

from pydantic import TypeAdapter

from benchmark.control.controller import Command, Controller
from benchmark.control.declarations import Declaration
from benchmark.control.intersection import Intersection
from benchmark.control.plugins import Plugin
from benchmark.control.state import TrafficState
from benchmark.control.training import Training
from benchmark.plumbing.errors import RightOfWayError
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal

TRAINED_ON = TypeAdapter(tuple[Training, ...] | None)
PROGRAMS = TypeAdapter(dict[str, Signal])
FAULTS = (Exception, SystemExit)  # a controller that exits must not end the whole suite

Decided = TypeVar("Decided", covariant=True)


class Judge(Protocol[Decided]):
    """What makes something of a controller's commands, as ``benchmark.world.rules.Rules`` does."""

    def decide(self, state: TrafficState, commands: Mapping[str, Command]) -> Decided:
        """What becomes of the commands; reads them, which may run the controller's code."""


class Decider(Protocol):
    """An episode's controller on a scenario, wherever it runs.

    Every method raises ``ControllerFailedError`` where the controller fails.
    """

    declaration: Declaration
    unsupported: str | None  # why the scenario is to be skipped
    weights_hash: str | None
    trained_on: tuple[Training, ...] | None

    @property
    def programs(self) -> Mapping[str, Signal]:
        """What SUMO runs, by junction; empty where lights are dark."""

    def reset(self, junctions: Mapping[str, Intersection], seed: int) -> None:
        """A new episode begins at every junction."""

    def act(self, junction: str, state: TrafficState, judge: Judge[Decided]) -> Decided:
        """What the judge makes of the controller's commands for the next step."""


class Opened(Protocol):
    """A controller that can be asked about scenarios."""

    @property
    def declaration(self) -> Declaration:
        """What its class says of itself."""

    def decider(self, scenario: Scenario) -> Decider:
        """The controller of an episode on a scenario."""


class ControllerFailedError(Exception):
    """A controller's episode is over.

    Args:
        reason: one line for the record.
        status: the record's.
    """

    def __init__(
        self, reason: str, status: Literal["failed", "crashed", "timed out"] = "failed"
    ) -> None:
        super().__init__(reason)
        self.status = status


def raised(call: str, error: BaseException) -> ControllerFailedError:
    """A call to a controller raised an error: which, and where in its files."""
    place = ""
    trace = error.__traceback__
    while trace is not None:
        file = Path(trace.tb_frame.f_code.co_filename)
        place = f" ({file.name}:{trace.tb_lineno})" if file != Path(__file__) else ""
        trace = trace.tb_next
    return ControllerFailedError(f"{call} raised {type(error).__name__}{_words(error)}{place}")


def _words(error: BaseException) -> str:
    try:
        words = str(error)
    except FAULTS:
        return ", whose message cannot be read"
    return f": {words}" if words else ""


@dataclass(frozen=True)
class Local:
    """A controller of this process."""

    plugin: Plugin

    @property
    def declaration(self) -> Declaration:
        """What its class says of itself."""
        return self.plugin.declaration

    def decider(self, scenario: Scenario) -> "Guard":
        """The controller of an episode on a scenario."""
        return Guard(self.plugin, scenario)


class Guard:
    """An episode's controller in this process: one object per junction, every call guarded.

    Args:
        plugin: the controller.
        scenario: what it is to run on; ``unsupported`` says why not, ``programs`` what SUMO runs.

    Raises:
        ControllerFailedError: from here and from every method, where the controller raised.
    """

    def __init__(self, plugin: Plugin, scenario: Scenario) -> None:
        self._plugin, self.declaration = plugin, plugin.declaration
        scenario = scenario.model_copy(deep=True)  # a controller may do to it what it likes
        self._first = self._new()
        self._by_junction: dict[str, Controller] = {}
        try:
            self.unsupported = self._first.supports(scenario)
            self.weights_hash = self._first.weights_hash
            self.trained_on = TRAINED_ON.validate_python(self._first.trained_on)
            lit = self.declaration.rules == "signals" and self.unsupported is None
            self.programs = self._programs(scenario) if lit else {}
        except RightOfWayError:
            raise
        except FAULTS as error:
            doing = "supports, signal, weights_hash or trained_on"
            raise raised(doing, error) from error

    def _new(self) -> Controller:
        try:
            return self._plugin.new()
        except RightOfWayError:
            raise
        except FAULTS as error:
            raise raised("construction", error) from error

    def _programs(self, scenario: Scenario) -> dict[str, Signal]:
        programs = {}
        for junction in scenario.junctions:
            program = self._first.signal(scenario, junction)
            if program is None:
                raise TypeError("signal returned None where signals rule")
            programs[junction] = program
        return programs

    def reset(self, junctions: Mapping[str, Intersection], seed: int) -> None:
        """A new episode begins at every junction."""
        for name, intersection in junctions.items():
            controller = self._by_junction[name] = self._new()
            try:
                controller.reset(intersection, seed)
            except FAULTS as error:
                raise raised("reset", error) from error

    def act(self, junction: str, state: TrafficState, judge: Judge[Decided]) -> Decided:
        """What the judge makes of the controller's commands for the next step."""
        try:
            return judge.decide(state, self._by_junction[junction].act(state))
        except FAULTS as error:
            raise raised(f"act at {state.time:g} s", error) from error

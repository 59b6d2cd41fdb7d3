"""Calls controllers so that whatever they do costs only their own episode."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, Protocol, TypeVar

from pydantic import TypeAdapter

from benchmark.control.controller import Command, Controller
from benchmark.control.intersection import Intersection
from benchmark.control.plugins import Plugin
from benchmark.control.state import TrafficState
from benchmark.control.training import Training
from benchmark.plumbing.errors import RightOfWayError
from benchmark.scenario.scenario import Scenario

TRAINED_ON = TypeAdapter(tuple[Training, ...] | None)
FAULTS = (Exception, SystemExit)  # a controller that exits must not end the whole suite

Decided = TypeVar("Decided", covariant=True)


class Decides(Protocol[Decided]):
    """What makes something of a controller's commands, as ``benchmark.world.rules.Rules`` does."""

    def decide(self, state: TrafficState, commands: Mapping[str, Command]) -> Decided:
        """What becomes of the commands; reads them, which may run the controller's code."""


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


class Guard:
    """An episode's controller in this process: one object per junction, every call guarded.

    Args:
        plugin: the controller.
        scenario: what it is to run on; ``unsupported`` says why not, ``signal`` what SUMO runs.

    Raises:
        ControllerFailedError: from here and from every method, where the controller raised.
    """

    def __init__(self, plugin: Plugin, scenario: Scenario) -> None:
        self._plugin, self.kind = plugin, plugin.kind
        scenario = scenario.model_copy(deep=True)  # a controller may do to it what it likes
        self._first = self._new()
        self._by_junction: dict[str, Controller] = {}
        try:
            self.unsupported = self._first.supports(scenario)
            self.weights_hash = self._first.weights_hash
            self.trained_on = TRAINED_ON.validate_python(self._first.trained_on)
            self.signal = None
            if self.kind.rules == "signals" and self.unsupported is None:
                self.signal = self._first.signal(scenario)
                if self.signal is None:
                    raise TypeError("signal returned None where signals rule")
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

    def reset(self, junctions: Mapping[str, Intersection], seed: int) -> None:
        """A new episode begins at every junction."""
        for name, intersection in junctions.items():
            controller = self._by_junction[name] = self._new()
            try:
                controller.reset(intersection, seed)
            except FAULTS as error:
                raise raised("reset", error) from error

    def act(self, junction: str, state: TrafficState, rules: Decides[Decided]) -> Decided:
        """What the rules make of the controller's commands for the next step."""
        try:
            return rules.decide(state, self._by_junction[junction].act(state))
        except FAULTS as error:
            raise raised(f"act at {state.time:g} s", error) from error

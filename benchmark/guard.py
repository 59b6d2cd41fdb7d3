"""Calls controllers so that whatever they do costs only their own episode."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import TypeAdapter

from benchmark.controller import Controller
from benchmark.errors import RightOfWayError
from benchmark.network import Junction
from benchmark.plugins import Plugin
from benchmark.record import Training
from benchmark.rules import Orders, Rules
from benchmark.scenario import Scenario
from benchmark.state import TrafficState

TRAINED_ON = TypeAdapter(tuple[Training, ...] | None)
FAULTS = (Exception, SystemExit)  # a controller that exits must not end the whole suite


class ControllerFailedError(Exception):
    """A controller raised; carries one line for the record."""

    def __init__(self, call: str, error: BaseException) -> None:
        place = ""
        trace = error.__traceback__
        while trace is not None:
            file = Path(trace.tb_frame.f_code.co_filename)
            place = f" ({file.name}:{trace.tb_lineno})" if file != Path(__file__) else ""
            trace = trace.tb_next
        super().__init__(f"{call} raised {type(error).__name__}: {error}{place}")


class Guard:
    """An episode's controller: one object per junction, every call guarded.

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
            raise ControllerFailedError(
                "supports, signal, weights_hash or trained_on", error
            ) from error

    def _new(self) -> Controller:
        try:
            return self._plugin.new()
        except RightOfWayError:
            raise
        except FAULTS as error:
            raise ControllerFailedError("construction", error) from error

    def reset(self, junctions: Mapping[str, Junction], seed: int) -> None:
        """A new episode begins at every junction."""
        for name, junction in junctions.items():
            controller = self._by_junction[name] = self._new()
            try:
                controller.reset(junction.intersection, seed)
            except FAULTS as error:
                raise ControllerFailedError("reset", error) from error

    def act(self, junction: str, state: TrafficState, rules: Rules) -> Orders:
        """A junction's orders for the next step."""
        try:
            return rules.decide(state, self._by_junction[junction].act(state))
        except FAULTS as error:
            raise ControllerFailedError(f"act at {state.time:g} s", error) from error

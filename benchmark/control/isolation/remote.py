"""The runner's side: a controller in a process of its own, with the interface of a guarded one."""

import os
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Self, TypeVar

from pydantic import ValidationError

from benchmark.control import plugins
from benchmark.control import reference as naming
from benchmark.control.commands import read_commands
from benchmark.control.declarations import Declaration
from benchmark.control.guard import (
    PROGRAMS,
    TRAINED_ON,
    ControllerFailedError,
    Decided,
    Judge,
    raised,
)
from benchmark.control.intersection import Intersection
from benchmark.control.isolation import channel
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.process import Process
from benchmark.control.isolation.readable import listed, readable
from benchmark.control.isolation.staging import Brought, Stage
from benchmark.control.state import TrafficState
from benchmark.plumbing.errors import ControllerError
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal


def isolated(reference: str, wish: bool | None) -> bool:
    """Whether a controller is to be isolated: as wished, else if it is a file's or a module's.

    Raises:
        ControllerError: it is no reference.
    """
    return wish if wish is not None else bool(naming.parse(reference).attribute)


def declaration_of(
    reference: str, wish: bool | None = None, limits: Limits = DEFAULT, folder: Path = Path()
) -> Declaration:
    """What a controller says of itself; where it is to be isolated, it is not imported here.

    Args:
        reference: as ``benchmark.control.plugins.find_controller`` reads it.
        wish: whether to isolate it; None: if it is not installed.
        limits: of time and memory.
        folder: where a file's relative path begins.

    Raises:
        ControllerError: it cannot be found, imported or isolated.
    """
    if not isolated(reference, wish):
        return plugins.find_controller(reference, folder).declaration
    return ask_declaration(str(naming.parse(reference).placed(folder)), limits)


@cache
def ask_declaration(reference: str, limits: Limits) -> Declaration:
    """What a controller's class says of itself, asked in a process of its own.

    Raises:
        ControllerError: it cannot be found, imported or isolated.
    """
    try:
        with Remote(reference, limits) as controller:
            return controller.declaration
    except ControllerFailedError as error:
        raise ControllerError(str(error)) from error


class Remote:
    """An isolated controller; a context manager that ends its process.

    Args:
        reference: its name, with options, as ``find_controller`` reads it.
        limits: of time and memory.
        brought: its code and files, which a bundle brings; None: as they are found here.

    Raises:
        ControllerFailedError: from here and from every method, where the controller failed.
        ControllerError: this system cannot isolate.
    """

    def __init__(self, reference: str, limits: Limits, brought: Brought | None = None) -> None:
        self._limits = limits
        self._stage = Stage(str(naming.parse(reference).placed(Path())), brought)
        try:
            self._process = Process(self._stage.told)
        except BaseException:
            self._stage.close()
            raise
        try:
            self.declaration = self._open(naming.label(reference))
        except BaseException:
            self._close()
            raise

    def _open(self, label: str) -> Declaration:
        stage, doing = self._stage, f'import of "{label}"'
        question = channel.Open(
            stage.reference,
            str(stage.root),
            stage.path,
            (*readable(stage.files), *stage.path),
            listed(),
            self._limits.memory,
            os.getpid(),
        )
        answer = self._process.ask(question, channel.Declared, doing, self._limits.start)
        said = answer.declaration.reference
        if naming.parse(said).name != naming.parse(stage.reference).name:
            raise ControllerFailedError(f'{doing}: it says it is "{said}"')
        return replace(answer.declaration, reference=stage.given(said))

    def _close(self) -> None:
        self._process.close()
        self._stage.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._close()

    def decider(self, scenario: Scenario) -> "RemoteGuard":
        """The controller of an episode on a scenario."""
        return RemoteGuard(self._process, self.declaration, scenario, self._limits)

    def attempt(self, victim: Path) -> Mapping[str, str]:
        """What comes of what isolation is to keep out; ``attempts`` names it."""
        question = channel.Try(str(victim))
        return self._process.ask(question, channel.Tried, "attempts", self._limits.start).outcomes


class RemoteGuard:
    """An episode's controller in another process; see ``benchmark.control.guard.Guard``.

    Args:
        process: where it runs.
        declaration: what its class says of itself.
        scenario: what it is to run on; ``unsupported`` says why not, ``programs`` what SUMO runs.
        limits: of time.
    """

    def __init__(
        self, process: Process, declaration: Declaration, scenario: Scenario, limits: Limits
    ) -> None:
        self._process, self.declaration, self._limits = process, declaration, limits
        self._left = limits.episode
        doing = "supports, signal, weights_hash or trained_on"
        answer = process.ask(channel.Ask.about(scenario), channel.Answer, doing, limits.start)
        self.unsupported, self.weights_hash = answer.unsupported, answer.weights_hash
        self.trained_on = _parsed(TRAINED_ON.validate_json, answer.trained_on, doing, "trained_on")
        self.programs: Mapping[str, Signal] = {}
        if declaration.rules == "signals" and self.unsupported is None:
            self.programs = _parsed(PROGRAMS.validate_json, answer.programs, doing, "programs")
            if self.programs.keys() != scenario.junctions.keys():
                raise ControllerFailedError(
                    f"{doing}: malformed answer: programs of other junctions"
                )

    def reset(self, junctions: Mapping[str, Intersection], seed: int) -> None:
        """A new episode begins at every junction."""
        question = channel.Begin(seed, dict(junctions))
        self._process.ask(question, channel.Begun, "reset", self._limits.start)

    def act(self, junction: str, state: TrafficState, judge: Judge[Decided]) -> Decided:
        """What the judge makes of the controller's commands for the next step."""
        doing = f"act at {state.time:g} s"
        question = channel.See(junction, state.time, state.vehicles, state.inside, state.phase)
        began = clock.perf_counter()
        answer = self._process.ask(question, channel.Commands, doing, self._limits.step)
        self._left -= clock.perf_counter() - began
        if self._left < 0:
            reason = f"{doing}: its answers took more than {self._limits.episode:g} s together"
            raise ControllerFailedError(reason, "timed out")
        try:
            return judge.decide(state, read_commands(answer.commands))
        except Exception as error:
            raise raised(doing, error) from error


Parsed = TypeVar("Parsed")


def _parsed(parse: Callable[[str], Parsed], text: str, doing: str, name: str) -> Parsed:
    try:
        return parse(text)
    except ValidationError as error:
        reason = f"{doing}: malformed answer: {name}: {error.errors()[0]['msg']}"
        raise ControllerFailedError(reason) from error

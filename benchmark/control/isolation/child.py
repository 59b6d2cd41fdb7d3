"""The controller's side: a process that answers one runner, and ends when it hangs up."""

import os
import socket
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from benchmark.control import plugins
from benchmark.control.commands import text, write_command
from benchmark.control.controller import Command, expect_mapping
from benchmark.control.guard import PROGRAMS, TRAINED_ON, ControllerFailedError, Guard, raised
from benchmark.control.intersection import Intersection
from benchmark.control.isolation import attempts, channel, imports, sandbox
from benchmark.control.isolation.channel import Channel
from benchmark.control.plugins import Plugin
from benchmark.control.state import TrafficState
from benchmark.plumbing.errors import ControllerError, RightOfWayError
from benchmark.scenario.scenario import Scenario

LONGEST_REASON = 2000  # characters
RESERVE = 8  # MB, let go when memory runs out, to say so


def main() -> None:
    """Serve the runner at the other end of the socket whose number is the first argument."""
    end = socket.socket(fileno=int(sys.argv[1]))
    end.set_inheritable(False)
    line = Channel(end, channel.QUESTIONS)
    service = Service()
    try:
        while True:
            question = line.receive()
            try:
                line.send(service.answer(question))
            except (TypeError, ValueError, NotImplementedError) as error:  # no text, for one
                line.send(service.fault(error, str(raised("its answer", error))))
    except (EOFError, OSError):
        os._exit(0)  # whatever the controller has arranged for the end


class Service:
    """Answers questions about one controller, the first of which opens it."""

    def __init__(self) -> None:
        self._memory = 0  # MB
        self._reserve = bytearray(RESERVE * 1_000_000)
        self._plugin: Plugin
        self._guard: Guard
        self._intersections: dict[str, Intersection] = {}

    def answer(self, question: channel.Message) -> channel.Message:
        """The answer to a question; a fault where the controller raised."""
        try:
            return self._answer(question)
        except (ControllerFailedError, RightOfWayError) as error:
            return self.fault(error, str(error))
        except BaseException as error:  # as KeyboardInterrupt, which nobody but it can have raised
            return self.fault(error, str(raised("the controller", error)))

    def fault(self, error: BaseException, reason: str) -> channel.Fault:
        """What to tell the runner of an error."""
        if isinstance(error.__cause__ or error, MemoryError):
            self._reserve = bytearray()
            reason = f"{reason}; its limit is {self._memory} MB"
        return channel.Fault(text(reason[:LONGEST_REASON]))

    def _answer(self, question: channel.Message) -> channel.Message:
        match question:
            case channel.Open():
                return self._open(question)
            case channel.Ask():
                return self._ask(question.scenario())
            case channel.Begin(seed, junctions):
                self._intersections = {
                    name: channel.read_only(intersection)
                    for name, intersection in junctions.items()
                }
                self._guard.reset(self._intersections, seed)
                return channel.Begun()
            case channel.See():
                state = question.state(self._intersections[question.junction])
                return self._guard.act(question.junction, state, Writer(self._plugin.label))
            case channel.Try(victim):
                return channel.Tried(attempts.tried(Path(victim)))
        raise AssertionError(question)

    def _open(self, opening: channel.Open) -> channel.Declared:
        empty = Path.cwd()
        self._memory = opening.memory
        try:
            readable = [*opening.readable, opening.folder, str(empty)]
            temporary = Path(os.environ["TMPDIR"])
            place = sandbox.Place(tuple(readable), opening.listed, temporary)
            sandbox.enter(place, opening.memory, opening.runner)
        except OSError as error:
            raise ControllerError(
                f"this system refuses to isolate: {error}; run what you trust with --no-isolate"
            ) from error
        imports.close()
        sys.path[:0] = opening.path  # not before: what lies there may shadow what was imported
        os.chdir(opening.folder)  # where the reference's paths begin
        plugin = plugins.find_controller(opening.reference)
        options = {
            key: value.absolute() if isinstance(value, Path) else value
            for key, value in plugin.options.items()
        }
        os.chdir(empty)
        self._plugin = replace(plugin, options=options)
        return channel.Declared(self._plugin.declaration)

    def _ask(self, scenario: Scenario) -> channel.Answer:
        self._guard = guard = Guard(self._plugin, scenario)
        programs = PROGRAMS.dump_json(dict(guard.programs)).decode()
        trained_on = TRAINED_ON.dump_json(guard.trained_on).decode()
        return channel.Answer(guard.unsupported, guard.weights_hash, programs, trained_on)


class Writer:
    """Writes commands down as they are; the runner's rules judge them.

    Args:
        controller: its name, for messages.
    """

    def __init__(self, controller: str) -> None:
        self._controller = controller

    def decide(self, state: TrafficState, commands: Mapping[str, Command]) -> channel.Commands:
        """The commands as a message.

        Raises:
            ControllerError: they are no mapping.
        """
        expect_mapping(self._controller, commands)
        return channel.Commands(
            [write_command(target, command) for target, command in commands.items()]
        )

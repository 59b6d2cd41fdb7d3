"""Controllers that misbehave, each in one way."""

import contextlib
import ctypes
import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from benchmark.control.controller import Command, Controller, Go
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState
from benchmark.scenario.scenario import Scenario


class Quiet(Controller):
    """Commands nothing; the others go on from here."""

    def reset(self, intersection: Intersection, seed: int) -> None:
        self.intersection = intersection

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {}


class RaisesInAct(Quiet):
    """Raises after ten seconds."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        if state.time >= 10:
            raise ValueError("no idea\n[what] to do")
        return {}


class RaisesInReset(Quiet):
    """Raises before the episode begins."""

    def reset(self, intersection: Intersection, seed: int) -> None:
        raise KeyError("weights")


class ReturnsNonsense(Quiet):
    """Returns a list."""

    def act(self, state: TrafficState) -> Any:
        return ["go"]


class CommandsHumans(Quiet):
    """Says Go to every HV."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {one.id: Go() for one in state.vehicles if not one.is_robot}


class MutatesState(Quiet):
    """Changes whatever can be changed; raises if a change of the traffic comes through."""

    def supports(self, scenario: Scenario) -> str | None:
        scenario.vehicles.clear()
        return None

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        where = self.intersection
        for table in (where.lanes, where.movements, where.phases, state.movements):
            for key in table:
                with contextlib.suppress(TypeError):
                    table[key] = None  # type: ignore[index]
                    raise RuntimeError(f"changed {key}")
        for thing in (state, where, *state.vehicles, *state.inside, *where.movements.values()):
            for name in ("id", "time", "speed", "movement", "conflicts"):
                with contextlib.suppress(AttributeError, TypeError):
                    setattr(thing, name, None)
                    raise RuntimeError(f"changed {name}")
        return {}


class LacksWeights(Quiet):
    """Finds no weights to hash."""

    @property
    def weights_hash(self) -> str:
        raise FileNotFoundError("weights.pt")


class MisspellsRules(Quiet):
    """Is ruled by something unheard of."""

    rules = "signal"


class Exits(Quiet):
    """Ends the interpreter politely."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        sys.exit("SUMO_HOME is not set")


class Crashes(Quiet):
    """Ends the process by a segmentation fault."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        ctypes.string_at(0)
        return {}


class Hangs(Quiet):
    """Never answers."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        while True:
            time.sleep(1)


class HangsOnce(Quiet):
    """Never answers, unless a file is there, which it makes."""

    def __init__(self, marker: str = "marker") -> None:
        self.marker = Path(marker)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        if not self.marker.exists():
            self.marker.write_text(str(os.getpid()))
            time.sleep(1000)
        return {}


class Devours(Quiet):
    """Takes memory and keeps it: as much as asked for, or all there is."""

    taken: ClassVar[list[bytearray]] = []

    def __init__(self, megabytes: int = 0) -> None:
        self.megabytes = megabytes

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        while len(self.taken) < self.megabytes or not self.megabytes:
            self.taken.append(bytearray(b"x" * 2**20))
        return {}


class NoController:
    """Lacks the base class."""


def __getattr__(name: str) -> Any:
    """What is not here ends the interpreter, as modules do that miss a variable."""
    if name == "Absent":
        sys.exit("set HOSTILE_HOME first")
    raise AttributeError(name)

"""Controllers that break the contract, each in one way that an author might not notice."""

import random
import socket
from collections.abc import Mapping
from typing import Any, ClassVar

from benchmark.control.controller import Command, Controller, Go, Stop
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState


class Tame(Controller):
    """Says Go to every RV that decides; the others go on from here."""

    def reset(self, intersection: Intersection, seed: int) -> None:
        self.intersection, self.random = intersection, random.Random(seed)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {one.id: self.choose(state) for one in state.deciding}

    def choose(self, state: TrafficState) -> Command:
        return Go() if self.random.random() < 0.8 else Stop()


class Nameless(Tame):
    pass


class Unmakeable(Tame):
    """Wants a file that is not there."""

    def __init__(self) -> None:
        open("weights.bin")  # noqa: PTH123, SIM115


class Remembers(Tame):
    """Counts its steps on and on."""

    def __init__(self) -> None:
        self.steps = 0

    def choose(self, state: TrafficState) -> Command:
        self.steps += 1
        return Go() if self.steps % 5 else Stop()


class Trips(Tame):
    """Stumbles over lanes of an episode before."""

    lanes: tuple[str, ...] | None = None

    def choose(self, state: TrafficState) -> Command:
        self.lanes = self.lanes or tuple(self.intersection.lanes)
        return Go() if state.intersection.lanes[self.lanes[-1]] else Stop()


class Shares(Tame):
    """Keeps its notes in the class."""

    notes: ClassVar[list[float]] = []

    def reset(self, intersection: Intersection, seed: int) -> None:
        self.notes.clear()

    def choose(self, state: TrafficState) -> Command:
        self.notes.append(state.time)
        return Go() if len(self.notes) % 5 else Stop()


class Dices(Tame):
    """Throws dice of its own."""

    def choose(self, state: TrafficState) -> Command:
        return random.choice([Go(), Stop()])


class Hashes(Tame):
    """Prefers whom a set names first."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        first = next(iter({one.id for one in state.deciding}), None)
        return {one.id: Go() if one.id == first else Stop() for one in state.deciding}


class Scribbles(Tame):
    """Keeps its notes on the state."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        vars(state)["note"] = 1
        return super().act(state)


class Forges(Tame):
    """Forces another order of its own on the vehicles."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        object.__setattr__(state, "vehicles", state.vehicles[::-1])
        return super().act(state)


class Moves(Tame):
    """Shortens the control zone."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        object.__setattr__(self.intersection, "control_zone", 1.0)
        return super().act(state)


class Commands(Tame):
    """Commands whoever is there."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {one.id: Stop() for one in state.vehicles if one.is_robot}


class Peeks(Tame):
    """Looks at the simulation."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        import libsumo

        assert libsumo.vehicle.getIDList() is not None
        return super().act(state)


class Foresees(Tame):
    """Looks at the next departures."""

    def reset(self, intersection: Intersection, seed: int) -> None:
        import importlib

        self.demand = importlib.import_module("benchmark.sumo.demand")
        super().reset(intersection, seed)


class Calls(Tame):
    """Calls home."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        with socket.socket() as line:
            line.settimeout(0.01)
            line.connect_ex(("127.0.0.1", 9))
        return super().act(state)


class FourOnly(Tame):
    """Is made for four approaches and many RVs."""

    approaches = (4,)
    rates = (0.6, 0.9)


class Picky(Tame):
    """Never finds a scenario to its taste."""

    def supports(self, scenario: Any) -> str | None:
        return f"{scenario.name} bores it"

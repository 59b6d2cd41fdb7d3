"""Controllers whose average waiting time is low for the wrong reason, or would be if they could."""

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from benchmark.control.controller import Command, Controller, Drive, Go
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal, SignalPhase

CREEPING = 0.15  # m/s; slower than 0.1 m/s is stationary


class Cheat(Controller):
    """Commands nothing; the others go on from here."""

    def reset(self, intersection: Intersection, seed: int) -> None:
        self.intersection = intersection

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {}


class Creeps(Cheat):
    """Never lets an RV stand: all creep through the control zone, faster than stationary."""

    arbitration = "own"

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {one.id: self._slow(one) for one in state.vehicles if one.is_robot}

    def _slow(self, ego: Vehicle) -> Drive:
        wanted = (CREEPING - ego.speed) / self.intersection.step
        return Drive(min(max(wanted, -ego.body.deceleration), ego.body.acceleration))


class Removes(Cheat):
    """Takes vehicles out of the simulation that wait over ten seconds, past the contract."""

    rules = "signals"
    needs_robot_vehicles = False

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        import libsumo

        for one in state.vehicles:
            if one.waiting > 10:
                libsumo.vehicle.remove(one.id)
        return {}


@dataclass
class Remove:
    """A command that the contract does not know."""


class AsksToRemove(Cheat):
    """Commands that vehicles disappear, RVs and HVs."""

    rules = "signals"

    def act(self, state: TrafficState) -> Mapping[str, Any]:
        return {one.id: Remove() for one in state.vehicles if one.waiting > 0}


class Relit(Cheat):
    """Brings a signal program of its own."""

    rules = "signals"
    needs_robot_vehicles = False


def program(scenario: Scenario, *, yielding: bool) -> Signal:
    """The scenario's program with one long phase for everybody."""
    assert scenario.signal is not None
    phases = scenario.signal.phases
    every = tuple(name for phase in phases for name in phase.movements)
    both = SignalPhase(movements=every, permitted=every if yielding else (), green=60)
    return scenario.signal.model_copy(update={"phases": (both, phases[0])})


class AllGreen(Relit):
    """Shows green to everybody at once."""

    def signal(self, scenario: Scenario, junction: str) -> Signal:
        return program(scenario, yielding=False)


class AllYield(Relit):
    """Shows green to everybody at once and says that all of them yield."""

    def signal(self, scenario: Scenario, junction: str) -> Signal:
        return program(scenario, yielding=True)


class AllGo(Cheat):
    """Says Go to every RV without a look at the others; lights show green to everybody."""

    arbitration = "own"

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {one.id: Go() for one in state.deciding}


class NoClearance(Relit):
    """The deployed program without yellow and all-red."""

    def signal(self, scenario: Scenario, junction: str) -> Signal:
        assert scenario.signal is not None
        return scenario.signal.model_copy(update={"yellow": 0.0, "all_red": 0.0})


class LightsOff(Relit):
    """Claims the lights' rule and has no program for them."""

    def signal(self, scenario: Scenario, junction: str) -> None:
        return None


class LightsDark(Cheat):
    """Says that RVs rule, so that lights are dark, and lets everybody drive by itself."""

    needs_robot_vehicles = False


class StopsToHide(Cheat):
    """Turns waiting into scheduled stops, which SUMO does not count, past the contract."""

    rules = "signals"
    needs_robot_vehicles = False

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        import libsumo

        for one in state.vehicles:
            if one.speed < 0.1:
                edge = libsumo.vehicle.getRoadID(one.id)
                position = libsumo.vehicle.getLanePosition(one.id)
                index = libsumo.vehicle.getLaneIndex(one.id)
                with contextlib.suppress(libsumo.TraCIException):
                    libsumo.vehicle.setStop(one.id, edge, position + 0.5, index, 5.0)
        return {}

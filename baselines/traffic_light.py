"""The signal programs: as deployed, by Webster's method, and actuated."""

from collections.abc import Mapping

from benchmark import network, webster
from benchmark.controller import Command, Controller
from benchmark.intersection import Intersection
from benchmark.scenario import Scenario, Signal
from benchmark.state import TrafficState


class TrafficLight(Controller):
    """The scenario's signal program as deployed."""

    rules = "signals"
    needs_robot_vehicles = False

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Nothing to forget: SUMO runs the program."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """No commands."""
        return {}


class TrafficLightWebster(TrafficLight):
    """The deployed phases with cycle and splits by Webster's method on the counts."""

    def signal(self, scenario: Scenario) -> Signal | None:
        """The retimed program."""
        if scenario.signal is None:
            return None
        junction = next(iter(network.build(scenario).junctions.values()))
        return webster.retimed(scenario, junction.intersection, scenario.signal)


class TrafficLightActuated(TrafficLightWebster):
    """The deployed phases, each green extended while vehicles arrive (SUMO's gap control).

    A green lasts at most ``LONGEST`` times Webster's, so that under balanced demand the program
    can still shift time between phases.
    """

    LONGEST = 1.5

    def signal(self, scenario: Scenario) -> Signal | None:
        """Webster's phases as an actuated program."""
        timed = super().signal(scenario)
        if timed is None:
            return None
        phases = tuple(
            phase.model_copy(update={"green": round(self.LONGEST * phase.green)})
            for phase in timed.phases
        )
        return timed.model_copy(update={"kind": "actuated", "phases": phases})

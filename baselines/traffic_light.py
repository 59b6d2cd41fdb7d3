"""The signal programs: as deployed, by Webster's method, and actuated."""

from collections.abc import Mapping

from benchmark.control.controller import Command, Controller
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal


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

    def signal(self, scenario: Scenario, junction: str) -> Signal | None:
        """The retimed program."""
        from benchmark.sumo import network, webster

        deployed = scenario.junctions[junction].signal
        if deployed is None:
            return None
        intersection = network.build_network(scenario).junctions[junction].intersection
        return webster.retimed(scenario, intersection, deployed)


class TrafficLightActuated(TrafficLightWebster):
    """The deployed phases, each green extended while vehicles arrive (SUMO's gap control).

    The settings are the best of a grid on the four intersections with the validation seeds 1001
    to 1003: at most 1, 1.25, 1.5 or 2 times Webster's green, gaps of 1.5, 2, 2.5 or 3 s.
    """

    LONGEST = 1.5  # times Webster's green
    GAP = 2.0  # s without a vehicle that ends a green

    def signal(self, scenario: Scenario, junction: str) -> Signal | None:
        """Webster's phases as an actuated program."""
        timed = super().signal(scenario, junction)
        if timed is None:
            return None
        phases = tuple(
            phase.model_copy(update={"green": round(self.LONGEST * phase.green)})
            for phase in timed.phases
        )
        return timed.model_copy(
            update={"kind": "actuated", "maximum_gap": self.GAP, "phases": phases}
        )

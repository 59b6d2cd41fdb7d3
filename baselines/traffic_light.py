"""The signal programs: as deployed, by Webster's method, and actuated."""

from collections.abc import Mapping

from benchmark.controller import Command, Controller
from benchmark.intersection import Intersection
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

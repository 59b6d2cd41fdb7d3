"""Nobody regulates: the paper's gridlock case."""

from collections.abc import Mapping

from benchmark.control.controller import Command, Controller
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState


class Unsignalised(Controller):
    """Lights dark and RVs drive as HVs do: nobody regulates."""

    needs_robot_vehicles = False

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Nothing to forget."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """No commands."""
        return {}

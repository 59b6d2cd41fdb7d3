"""Stop signs as SUMO and the law have them: how to do without signals and without robots.

Everybody stops, and whoever stopped first goes first (SUMO's junction type ``allway_stop``); where
the scenario gives approaches priority, only the others stop, and wait for gaps
(``priority_stop``). MUTCD, 11th edition, part 2B; Uniform Vehicle Code, section 11-403.
"""

from collections.abc import Mapping

from benchmark.control.controller import Command, Controller
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState


class StopControlled(Controller):
    """Stop signs for all, or for all but the approaches that the scenario gives priority."""

    rules = "stop signs"
    needs_robot_vehicles = False

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Nothing to forget."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """No commands."""
        return {}

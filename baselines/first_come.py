"""Every RV always says Go; only the arbitration holds it back."""

from collections.abc import Mapping

from benchmark.control.controller import Command, Controller, Go
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState


class FirstCome(Controller):
    """Every RV says Go and the conflict arbitration decides."""

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Nothing to forget."""

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Go for every RV that decides."""
        return {vehicle.id: Go() for vehicle in state.deciding}

"""RVs act as a signal between them: a rule that needs no training and no lights."""

from collections.abc import Mapping

from pydantic import NonNegativeFloat, PositiveFloat

from benchmark.control.controller import Command, Controller, Go, Stop
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState


class VirtualSignal(Controller):
    """RVs act as a signal: the conflict-free set with the most vehicles and waiting goes.

    The settings come from grids on the four intersections at 50 and 60 % with the validation seeds
    1001 to 1003 (greens of 10 to 30 s, clearances of 0 to 2 s, weights 0.03 to 1); greens of 15 to
    25 s differ by less than seeds do.

    Args:
        green: how long a set keeps its turn while others wait [s].
        clearance: pause between two sets, in which every RV stops [s].
        waiting_weight: how many vehicles a second of mean waiting is worth to each [1/s].
    """

    def __init__(
        self,
        green: PositiveFloat = 20.0,
        clearance: NonNegativeFloat = 2.0,
        waiting_weight: NonNegativeFloat = 0.1,
    ) -> None:
        self._green, self._clearance, self._waiting_weight = green, clearance, waiting_weight

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Forget whose turn it was."""
        self._sets = sorted(sorted(chosen) for chosen in intersection.conflict_free_sets)
        self._turn: list[str] = []
        self._clear_at = self._since = 0.0

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Go for the set whose turn it is, Stop for the others."""
        if state.time - self._since >= self._green or not self._demand(state, self._turn):
            best = max(self._sets, key=lambda chosen: self._demand(state, chosen))
            if best != self._turn and self._demand(state, best):
                self._turn = best
                self._clear_at = state.time + self._clearance
                self._since = self._clear_at
        open_now = state.time >= self._clear_at
        return {
            vehicle.id: Go() if open_now and vehicle.movement in self._turn else Stop()
            for vehicle in state.deciding
        }

    def _demand(self, state: TrafficState, chosen: list[str]) -> float:
        return sum(state.movements[name].pressure(self._waiting_weight) for name in chosen)

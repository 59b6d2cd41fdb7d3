"""An adaptive signal: the phase with the greatest pressure goes.

P. Varaiya, Max pressure control of a network of signalized intersections, Transportation Research
Part C 36, 2013. Roads behind the intersection carry traffic away freely here, so the pressure of
a movement is its upstream count.
"""

from collections.abc import Mapping

from pydantic import NonNegativeFloat, PositiveFloat

from benchmark.control.controller import Command, Controller, Phase
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState


class MaxPressure(Controller):
    """An adaptive signal: the phase whose movements press most, by number and waiting, goes.

    Counts alone starve short left-turn queues; weighting them by waiting halves average waiting
    time here. Both settings are the best of a grid on the four intersections with the validation
    seeds 1001 to 1003 (intervals 8, 12 and 16 s, weights 0.02, 0.1 and 1).

    Args:
        interval: how long a phase is kept before pressures are compared again [s].
        waiting_weight: how many vehicles a second of mean waiting is worth to each [1/s].
    """

    rules = "signals"
    needs_robot_vehicles = False

    def __init__(
        self, interval: PositiveFloat = 12.0, waiting_weight: NonNegativeFloat = 0.1
    ) -> None:
        self._interval, self._waiting_weight = interval, waiting_weight

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Forget the phase that was shown."""
        self._id, self._phases = intersection.id, intersection.phases
        self._chosen: str | None = None
        self._green_since: float | None = None

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Keep the phase for the interval, then change to the one with the greatest pressure."""
        if state.phase is None and self._chosen is not None:
            self._green_since = None  # yellow or all-red
        elif self._green_since is None:
            self._green_since = state.time
        if self._chosen is None or (
            self._green_since is not None and state.time - self._green_since >= self._interval
        ):
            best = max(self._phases, key=lambda name: self._pressure(state, name))
            if best != self._chosen:
                self._chosen, self._green_since = best, None
            else:
                self._green_since = state.time
        assert self._chosen is not None
        return {self._id: Phase(self._chosen)}

    def _pressure(self, state: TrafficState, phase: str) -> float:
        return sum(
            state.movements[name].pressure(self._waiting_weight)
            for name in sorted(self._phases[phase])  # a sum's last digit depends on the order
        )

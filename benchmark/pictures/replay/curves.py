"""One junction's log -> its figures step by step, as replays show them while they run."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from benchmark.pictures.replay.trajectories import Curves, Floats, Ints
from benchmark.sumo.junction import Junction
from benchmark.world import metrics
from benchmark.world.scoring import Sights
from benchmark.world.tracking import Log


@dataclass(frozen=True)
class Zone:
    """One junction of an episode that is over."""

    junction: Junction
    log: Log
    lights: Sequence[str]  # the signal's state in each step; empty where lights are dark

    @cached_property
    def sights(self) -> Sights:
        """Who was in the control zone when."""
        return Sights.of(self.junction, self.log)

    def curves(self, start: int) -> Curves:
        """The figures of each step.

        Args:
            start: the evaluation window's first step.
        """
        seen = self.sights
        waiting, vehicles = self._by_movement()
        states = list(dict.fromkeys(self.lights))
        place = {state: index for index, state in enumerate(states)}
        return Curves(
            average=metrics.average_waiting_curve(seen.step, seen.waiting, seen.steps, start),
            waiting=metrics.mean_waiting(seen.step, seen.waiting, seen.steps),
            movement_waiting=waiting,
            movement_vehicles=vehicles,
            passed=self._passed(start),
            unregulated=self._unregulated(),
            states=states,
            light=np.asarray([place[state] for state in self.lights], dtype=np.int64),
        )

    def _by_movement(self) -> tuple[Floats, Ints]:
        """Mean waiting and vehicles of every movement, shape (movements, steps)."""
        seen, names = self.sights, list(self.junction.intersection.movements)
        index = np.asarray([names.index(v.movement) for v in self.log.vehicles], dtype=np.int64)
        cell = index[seen.vehicle] * seen.steps + seen.step
        shape, cells = (len(names), seen.steps), len(names) * seen.steps
        present = np.bincount(cell, minlength=cells).astype(np.int64)
        waiting = metrics.mean_waiting(cell, seen.waiting, cells)
        return waiting.reshape(shape), present.reshape(shape)

    def _passed(self, start: int) -> Ints:
        """Vehicles past the entrance in the window up to each step, as throughput counts them."""
        seen = self.sights
        last = seen.step[metrics.last_sights(seen.step, seen.vehicle, start)]
        gone = np.bincount(last[last < seen.steps - 1] + 1, minlength=seen.steps)
        return np.cumsum(gone).astype(np.int64)

    def _unregulated(self) -> Ints:
        """Whether each regulated lane is without an RV, shape (regulated lanes, steps)."""
        seen = self.sights
        led = np.zeros((len(self.log.lanes), seen.steps), dtype=bool)
        led[seen.lane[seen.is_robot], seen.step[seen.is_robot]] = True
        rows = [self.log.lanes.index(one) for one in self.junction.intersection.regulated_lanes]
        return (~led[rows]).astype(np.int64)

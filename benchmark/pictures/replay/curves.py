"""One junction's log -> its figures step by step, as replays show them while they run."""

from collections.abc import Sequence

import numpy as np

from benchmark.control.intersection import Intersection
from benchmark.pictures.replay.trajectories import Curves, Floats, Ints
from benchmark.world import metrics
from benchmark.world.scoring import Sights
from benchmark.world.tracking import Log


def curves_of(
    intersection: Intersection, log: Log, seen: Sights, lights: Sequence[str], start: int
) -> Curves:
    """The figures of each step.

    Args:
        intersection: where.
        log: who was in its control zone in an episode that is over.
        seen: the log as arrays.
        lights: the signal's state in each step; empty where lights are dark.
        start: the evaluation window's first step.
    """
    waiting, vehicles = _by_movement(list(intersection.movements), log, seen)
    states = list(dict.fromkeys(lights))
    place = {state: index for index, state in enumerate(states)}
    return Curves(
        average=metrics.average_waiting_curve(seen.step, seen.waiting, seen.steps, start),
        waiting=metrics.mean_waiting(seen.step, seen.waiting, seen.steps),
        movement_waiting=waiting,
        movement_vehicles=vehicles,
        passed=_passed(seen, start),
        unregulated=_unregulated([log.lanes.index(i) for i in intersection.regulated_lanes], seen),
        states=states,
        light=np.asarray([place[state] for state in lights], dtype=np.int64),
    )


def _by_movement(movements: Sequence[str], log: Log, seen: Sights) -> tuple[Floats, Ints]:
    """Mean waiting and vehicles of every movement, shape (movements, steps)."""
    index = np.asarray([movements.index(v.movement) for v in log.vehicles], dtype=np.int64)
    cell = index[seen.vehicle] * seen.steps + seen.step
    shape, cells = (len(movements), seen.steps), len(movements) * seen.steps
    present = np.bincount(cell, minlength=cells).astype(np.int64)
    waiting = metrics.mean_waiting(cell, seen.waiting, cells)
    return waiting.reshape(shape), present.reshape(shape)


def _passed(seen: Sights, start: int) -> Ints:
    """Vehicles past the entrance in the window up to each step, as throughput counts them."""
    last = seen.step[metrics.last_sights(seen.step, seen.vehicle, start)]
    gone = np.bincount(last[last < seen.steps - 1] + 1, minlength=seen.steps)
    return np.cumsum(gone).astype(np.int64)


def _unregulated(regulated: Sequence[int], seen: Sights) -> Ints:
    """Whether each regulated lane is without an RV, shape (regulated lanes, steps)."""
    led = np.zeros((len(seen.regulated_lanes), seen.steps), dtype=bool)
    led[seen.lane[seen.is_robot], seen.step[seen.is_robot]] = True
    return (~led[regulated]).astype(np.int64)

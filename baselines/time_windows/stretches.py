"""Where ways through an intersection come too close to each other: conflict stretches."""

from functools import cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from benchmark.control.intersection import Intersection, Way

SPACING = 0.25  # m between the places at which two ways are compared

Numbers = npt.NDArray[np.float64]


class Conflicts(NamedTuple):
    """The conflict stretches of all regulated ways of an intersection.

    ``start[i, j]`` and ``end[i, j]`` [m behind the entrance] bound the stretch of way i that way j
    comes close to; both are NaN where the two never meet.
    """

    ways: tuple[Way, ...]
    movements: tuple[str, ...]  # of each way
    start: Numbers  # (ways, ways)
    end: Numbers  # (ways, ways)


def lane_conflicts(intersection: Intersection, clearance: float) -> Conflicts:
    """The stretches of each pair of ways that come from different approaches.

    Nothing but the shapes of the ways counts, so any geometry will do.

    Args:
        intersection: where.
        clearance: ways conflict where their centre lines are closer than this [m].
    """
    return _lane_conflicts(_regulated(intersection), clearance)


@cache
def _lane_conflicts(named: tuple[tuple[str, str, Way], ...], clearance: float) -> Conflicts:
    conflicts = _without_conflicts(named)
    for i, j in combinations(range(len(named)), 2):
        (_, approach, way), (_, other_approach, other) = named[i], named[j]
        if approach != other_approach and (both := _meet(way, other, clearance)):
            for pair, stretch in zip(((i, j), (j, i)), both, strict=True):
                conflicts.start[pair], conflicts.end[pair] = stretch
    return conflicts


def movement_conflicts(intersection: Intersection) -> Conflicts:
    """The whole way as the stretch, wherever two movements conflict: for comparison."""
    named = _regulated(intersection)
    conflicts = _without_conflicts(named)
    for i, (movement, _, way) in enumerate(named):
        for j, (other, _, _) in enumerate(named):
            if intersection.conflict(movement, other):
                conflicts.start[i, j], conflicts.end[i, j] = 0.0, way.length
    return conflicts


def _regulated(intersection: Intersection) -> tuple[tuple[str, str, Way], ...]:
    """Movement, approach and way of each regulated way."""
    return tuple(
        (movement.id, movement.approach, way)
        for movement in intersection.movements.values()
        if movement.regulated
        for way in movement.ways
    )


def _without_conflicts(named: tuple[tuple[str, str, Way], ...]) -> Conflicts:
    nothing = np.full((len(named), len(named)), np.nan)
    movements, _, ways = zip(*named, strict=True)
    return Conflicts(ways, movements, nothing, nothing.copy())


def _meet(
    one: Way, other: Way, clearance: float
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Start and end of the stretches along which two ways are too close, if there are any."""
    (places, points), (other_places, other_points) = _sampled(one), _sampled(other)
    apart = np.hypot(*(points[:, None, :] - other_points[None, :, :]).transpose(2, 0, 1))
    near = apart < clearance
    if not near.any():
        return None
    return _extent(places[near.any(axis=1)], one), _extent(other_places[near.any(axis=0)], other)


def _extent(places: Numbers, way: Way) -> tuple[float, float]:
    half = SPACING / 2  # what lies between a place and the next
    return max(0.0, float(places[0]) - half), min(way.length, float(places[-1]) + half)


@cache
def _sampled(way: Way) -> tuple[Numbers, Numbers]:
    """Evenly spaced places along a way [m behind the entrance] and their points."""
    shape = np.array(way.shape, dtype=np.float64)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(shape, axis=0).T))])
    places = np.linspace(0.0, along[-1], max(2, round(along[-1] / SPACING) + 1))
    points = np.column_stack([np.interp(places, along, shape[:, axis]) for axis in (0, 1)])
    return places * (way.length / along[-1]), points

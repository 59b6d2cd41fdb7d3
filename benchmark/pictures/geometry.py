"""Lines and outlines in the plane: what drawings are made of.

Everything is in metres, x to the east and y to the north.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]  # (n, 2), m


def points(shape: Sequence[tuple[float, float]]) -> Points:
    """A shape as an array."""
    return np.asarray(shape, dtype=np.float64)


def directions(line: Points) -> Points:
    """Unit tangents at the points of a line."""
    steps = np.diff(line, axis=0)
    steps /= np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-9)
    tangents = np.vstack([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    unit: Points = tangents / np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-9)
    return unit


def shifted(line: Points, right: float) -> Points:
    """A line beside another, to the right of its direction [m]."""
    tangents = directions(line)
    moved: Points = line + right * np.column_stack([tangents[:, 1], -tangents[:, 0]])
    return moved


def ribbon(line: Points, width: float) -> Points:
    """The outline of a line with a width [m]."""
    return np.vstack([shifted(line, width / 2), shifted(line, -width / 2)[::-1]])


def stretch(line: Points, near: float, far: float) -> Points | None:
    """The part of a line between two distances from its end [m]; None where there is none."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    start, end = max(along[-1] - far, 0.0), min(along[-1] - near, along[-1])
    if start >= end:
        return None
    places = [start, *(place for place in along if start < place < end), end]
    return np.column_stack([np.interp(places, along, line[:, axis]) for axis in (0, 1)])


def curve(start: Points, out: Points, into: Points, end: Points) -> Points:
    """A cubic Bezier curve by its four control points."""
    t = np.linspace(0, 1, 40)[:, None]
    bent: Points = (
        (1 - t) ** 3 * start + 3 * (1 - t) ** 2 * t * out + 3 * (1 - t) * t**2 * into + t**3 * end
    )
    return bent


@dataclass(frozen=True)
class RoadPlace:
    """A point on a road, such as where it meets an intersection, and the direction of travel."""

    origin: Points
    ahead: Points

    @classmethod
    def of(cls, shapes: Sequence[Sequence[tuple[float, float]]], end: int) -> "RoadPlace":
        """The mean of lanes at their starts (0) or ends (-1)."""
        lines = [points(shape) for shape in shapes]
        ahead = np.mean([directions(line)[end] for line in lines], axis=0)
        return cls(np.mean([line[end] for line in lines], axis=0), ahead / np.linalg.norm(ahead))

    @property
    def right(self) -> Points:
        """The unit vector to the right of the direction."""
        return np.array([self.ahead[1], -self.ahead[0]])

    def at(self, right: float, ahead: float) -> Points:
        """A point by its place beside and ahead of the origin [m]."""
        place: Points = self.origin + right * self.right + ahead * self.ahead
        return place

    def beside(self, point: Points) -> float:
        """How far a point lies to the right [m]."""
        return float((point - self.origin) @ self.right)

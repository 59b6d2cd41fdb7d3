"""How near two movements come inside the box, and how wide it must be for both to go together."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmark.control.intersection import Movement, Point, Way
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import network

RADII = (6.0, 8.0, 10.0, 12.0, 15.0, 20.0)  # m, that are tried
SPACING = 0.25  # m between the points of a path


@dataclass(frozen=True)
class Nearest:
    """Where the paths of two movements come nearest."""

    lanes: tuple[str, str]  # incoming
    distance: float  # m between their centre lines


def nearest(movement: Movement, other: Movement) -> Nearest:
    """The two ways of two movements that come nearest to each other."""
    return min(
        (
            Nearest((way.lane, beside.lane), _distance(way, beside))
            for way in movement.ways
            for beside in other.ways
        ),
        key=lambda each: each.distance,
    )


def radius_for(scenario: Scenario, junction: str, movement: str, other: str) -> float | None:
    """The smallest corner radius that is tried under which two movements do not conflict [m].

    None where none of them helps.
    """
    return next(_radii(scenario, junction, movement, other), None)


def _radii(scenario: Scenario, junction: str, movement: str, other: str) -> Iterator[float]:
    for radius in RADII:
        if radius > (scenario.intersection.radius or 0.0):
            wider = network.build_network(scenario.with_radius(radius)).junctions[junction]
            if not wider.intersection.conflict(movement, other):
                yield radius


def _distance(way: Way, other: Way) -> float:
    from scipy.spatial.distance import cdist

    return float(cdist(_points(way.shape), _points(other.shape)).min())


def _points(shape: tuple[Point, ...]) -> NDArray[np.float64]:
    """Points along a line, evenly spaced."""
    corners = np.array(shape)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    places = np.arange(0.0, along[-1] + SPACING, SPACING)
    return np.stack([np.interp(places, along, corners[:, axis]) for axis in (0, 1)], axis=1)

"""What lies on the ground in a network, for drawings: lanes, and the areas where roads meet."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from benchmark.control.intersection import DrivingSide, Point
from benchmark.sumo.junction import shape_of
from benchmark.sumo.network import Network, open_network


@dataclass(frozen=True, slots=True)
class RoadLane:
    """A lane of a road as it lies on the ground, for drawings."""

    id: str
    road: str  # id of its edge
    index: int  # 0 at the kerb
    width: float  # m
    shape: tuple[Point, ...]  # m, centre line in driving direction
    inside: bool  # whether it lies inside a junction


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What lies on the ground in a network: lanes and the areas where roads meet."""

    lanes: Mapping[str, RoadLane]
    areas: tuple[tuple[Point, ...], ...]  # m, outlines of the junctions
    driving_side: DrivingSide = "right"


def surroundings(network: Network) -> Surroundings:
    """Every lane of a network, also those that leave, and the outline of every junction."""
    roads = open_network(network.path)
    edges = sorted(roads.getEdges(withInternal=True), key=lambda edge: str(edge.getID()))
    lanes = (lane for edge in edges for lane in edge.getLanes())
    outlines = (node.getShape() for node in roads.getNodes())
    return Surroundings(
        lanes={lane.getID(): _road_lane(lane) for lane in lanes},
        areas=tuple(tuple((x, y) for x, y in outline) for outline in outlines if len(outline) > 2),
        driving_side=network.intersections[0].driving_side,
    )


def _road_lane(lane: Any) -> RoadLane:
    edge = lane.getEdge()
    return RoadLane(
        id=lane.getID(),
        road=edge.getID(),
        index=lane.getIndex(),
        width=lane.getWidth(),
        shape=shape_of(lane),
        inside=edge.getFunction() == "internal",
    )

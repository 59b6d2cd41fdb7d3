"""Scenario and network -> the ground that replays show."""

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from benchmark.control.intersection import Intersection
from benchmark.pictures import pavement
from benchmark.pictures.geometry import Points, directions, points, ribbon, stretch
from benchmark.pictures.replay.trajectories import (
    Ground,
    Head,
    JunctionGround,
    Movement,
    Outline,
    Place,
    RegulatedLane,
    StopLine,
)
from benchmark.scenario.scenario import Scenario
from benchmark.sumo.junction import Junction
from benchmark.sumo.network import Network, surroundings

HEAD_GAP = 0.9  # of a lane's width that its heads take


def ground_of(scenario: Scenario, network: Network) -> Ground:
    """Everything of a network that does not move, as outlines."""
    around = surroundings(network)
    between, middle = pavement.lines(around)
    junctions = list(network.junctions.values())
    intersections = [one.intersection for one in junctions]

    def zones(reach: str) -> list[Outline]:
        return _outlines(
            shape
            for one in junctions
            for _, shape in pavement.zone(one, around, getattr(one.intersection, reach))
        )

    return Ground(
        asphalt=_outlines(pavement.asphalt(around)),
        lane_lines=_outlines(between),
        centre_lines=_outlines(middle),
        arrows=_outlines(arrow for one in intersections for arrow in pavement.arrows(one)),
        stop_lines=[
            StopLine((_place(line.ends[0]), _place(line.ends[1])), line.yields)
            for one in intersections
            for line in pavement.stop_lines(scenario, one)
        ],
        control_zone=zones("control_zone"),
        decision_zone=zones("decision_zone"),
        junctions=[_junction(one) for one in junctions],
    )


def _junction(junction: Junction) -> JunctionGround:
    intersection = junction.intersection
    ways = [way for one in intersection.movements.values() for way in one.ways]
    gates = np.array([way.shape[end] for way in ways for end in (0, -1)])
    centre = (gates.min(axis=0) + gates.max(axis=0)) / 2
    return JunctionGround(
        id=intersection.id,
        centre=_place(centre),
        radius=round(float(np.abs(gates - centre).max()), 2),
        movements=[
            Movement(one.id, one.approach, one.turn) for one in intersection.movements.values()
        ],
        regulated_lanes=list(_regulated(intersection)),
        heads=list(_heads(junction)),
    )


def _regulated(intersection: Intersection) -> Iterable[RegulatedLane]:
    for name in intersection.regulated_lanes:
        lane = intersection.lanes[name]
        part = stretch(points(lane.shape), 0.0, intersection.control_zone)
        assert part is not None
        yield RegulatedLane(name, _outline(ribbon(part, lane.width)))


def _heads(junction: Junction) -> Iterable[Head]:
    """The heads of each lane side by side at its stop line, left turns to the left."""
    intersection = junction.intersection
    by_lane: dict[str, list[int]] = {}
    for index, name in junction.links.items():
        lanes = [way.lane for way in intersection.movements[name].ways]
        before = [i for i, other in junction.links.items() if other == name and i < index]
        by_lane.setdefault(lanes[len(before)], []).append(index)
    for name, links in by_lane.items():
        lane = intersection.lanes[name]
        line = points(lane.shape)
        ahead = directions(line)[-1]
        right = np.array([ahead[1], -ahead[0]])
        size = HEAD_GAP * lane.width / len(links)
        turns = sorted(links, key=lambda i: "LCR".index(_turn(intersection, junction.links[i])))
        for order, link in enumerate(turns):
            aside = (order - (len(links) - 1) / 2) * size
            angle = float(np.degrees(np.arctan2(ahead[0], ahead[1])))
            yield Head(link, _place(line[-1] + aside * right), round(angle, 1), round(size, 2))


def _turn(intersection: Intersection, movement: str) -> str:
    return intersection.movements[movement].turn


def _outlines(shapes: Iterable[Points]) -> list[Outline]:
    return [_outline(shape) for shape in shapes]


def _outline(shape: Points) -> Outline:
    """A shape in centimetres, without repeated points."""
    places = [_place(point) for point in shape]
    return [*places[:1], *(after for before, after in pairwise(places) if before != after)]


def _place(point: Points) -> Place:
    x, y = point
    return round(float(x), 2), round(float(y), 2)

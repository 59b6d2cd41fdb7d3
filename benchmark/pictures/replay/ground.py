"""Scenario and network -> the ground that replays show."""

from collections import Counter
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from benchmark.control.intersection import Intersection
from benchmark.pictures import pavement
from benchmark.pictures.geometry import Points, RoadPlace, directions, points, ribbon, stretch
from benchmark.pictures.replay.trajectories import (
    Ground,
    Head,
    JunctionGround,
    MovementName,
    Outline,
    Place,
    RegulatedLane,
    StopLine,
)
from benchmark.scenario.scenario import Scenario
from benchmark.sumo.ground import surroundings
from benchmark.sumo.junction import Junction
from benchmark.sumo.network import Network

HEAD_GAP = 0.9  # of a lane's width that its heads take


def ground_of(scenario: Scenario, network: Network) -> Ground:
    """Everything of a network that does not move, as outlines."""
    around = surroundings(network)
    between, middle = pavement.lines(around)
    junctions = list(network.junctions.values())
    intersections = [junction.intersection for junction in junctions]

    def zones(reach: str) -> list[Outline]:
        return _outlines(
            shape
            for junction in junctions
            for _, shape in pavement.zone(junction, around, getattr(junction.intersection, reach))
        )

    return Ground(
        asphalt=_outlines(pavement.asphalt(around)),
        lane_lines=_outlines(between),
        centre_lines=_outlines(middle),
        arrows=_outlines(
            arrow for intersection in intersections for arrow in pavement.arrows(intersection)
        ),
        stop_lines=[
            StopLine((_place(left), _place(right)), yields)
            for intersection in intersections
            for (left, right), yields in pavement.stop_lines(scenario, intersection)
        ],
        control_zone=zones("control_zone"),
        decision_zone=zones("decision_zone"),
        junctions=[_junction(junction) for junction in junctions],
    )


def _junction(junction: Junction) -> JunctionGround:
    intersection = junction.intersection
    centre, radius = pavement.middle(intersection)
    return JunctionGround(
        id=intersection.id,
        centre=_place(centre),
        radius=round(radius, 2),
        movements=[
            MovementName(movement.id, movement.approach, movement.turn)
            for movement in intersection.movements.values()
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
    """The heads of each lane side by side at its stop line, as their ways lie."""
    movements = junction.intersection.movements
    abreast = junction.intersection.turns_abreast
    by_lane: dict[str, list[int]] = {}
    met: Counter[str] = Counter()
    for link, name in junction.links.items():
        by_lane.setdefault(movements[name].lanes[met[name]], []).append(link)
        met[name] += 1
    for name, links in by_lane.items():
        lane = junction.intersection.lanes[name]
        line = points(lane.shape)
        entrance = RoadPlace(line[-1], directions(line)[-1])
        east, north = entrance.ahead
        angle = round(float(np.degrees(np.arctan2(east, north))), 1)
        size = HEAD_GAP * lane.width / len(links)
        links.sort(key=lambda link: abreast.index(movements[junction.links[link]].turn))
        for order, link in enumerate(links):
            aside = (order - (len(links) - 1) / 2) * size
            yield Head(link, _place(entrance.at(aside, 0.0)), angle, round(size, 2))


def _outlines(shapes: Iterable[Points]) -> list[Outline]:
    return [_outline(shape) for shape in shapes]


def _outline(shape: Points) -> Outline:
    """A shape in centimetres, without repeated points."""
    places = [_place(point) for point in shape]
    return [*places[:1], *(after for before, after in pairwise(places) if before != after)]


def _place(point: Points) -> Place:
    x, y = point
    return round(float(x), 2), round(float(y), 2)

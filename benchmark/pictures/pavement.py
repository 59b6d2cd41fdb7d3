"""What lies and is painted on the ground of an intersection, as lines and outlines in metres."""

from collections.abc import Iterator

import numpy as np

from benchmark.control.intersection import Intersection, Lane
from benchmark.pictures.geometry import Points, RoadPlace, curve, points, ribbon, shifted, stretch
from benchmark.scenario.scenario import Scenario
from benchmark.sumo.ground import Surroundings
from benchmark.sumo.junction import Junction

SHOULDER = 0.3  # m of asphalt beside a lane
ARROW_SETBACK, ARROW_LENGTH = 5.0, 10.0  # m from the entrance, and stretched as painted ones are


def middle(intersection: Intersection) -> tuple[Points, float]:
    """The middle of the box around all entrances and exits, and how far its sides are from it."""
    ways = [way for movement in intersection.movements.values() for way in movement.ways]
    gates = points([way.shape[end] for way in ways for end in (0, -1)])
    centre = (gates.min(axis=0) + gates.max(axis=0)) / 2
    return centre, float(np.abs(gates - centre).max())


def asphalt(ground: Surroundings) -> list[Points]:
    """The outlines of all lanes and of the areas where roads meet."""
    lanes = ground.lanes.values()
    shapes = [ribbon(points(lane.shape), lane.width + 2 * SHOULDER) for lane in lanes]
    return shapes + [points(area) for area in ground.areas]


def zone(junction: Junction, ground: Surroundings, reach: float) -> Iterator[tuple[str, Points]]:
    """The approach and the outline of each lane's part within a distance of the entrance [m]."""
    for name, place in junction.zone.items():
        lane = ground.lanes[name]
        part = stretch(points(lane.shape), -place.end, reach - place.end)
        if part is not None:
            yield place.approach, ribbon(part, lane.width)


def lines(ground: Surroundings) -> tuple[list[Points], list[Points]]:
    """The dashed lines between lanes, and the lines that part the directions of traffic."""
    between: list[Points] = []
    middle: list[Points] = []
    inwards = -1 if ground.driving_side == "right" else 1
    for lane in ground.lanes.values():
        if not lane.inside:
            innermost = f"{lane.road}_{lane.index + 1}" not in ground.lanes
            line = shifted(points(lane.shape), inwards * lane.width / 2)
            (middle if innermost else between).append(line)
    return between, middle


def stop_lines(scenario: Scenario, intersection: Intersection) -> Iterator[tuple[Points, bool]]:
    """The left and right end of each incoming lane's stop line, and whether one yields there.

    From a slip lane one yields, and nobody has to stop.
    """
    for lane in intersection.lanes.values():
        approach = getattr(scenario.approaches, lane.approach, None)
        yields = approach is not None and approach.slip_lane and _keeps_to_kerb(intersection, lane)
        line = points(lane.shape)
        yield np.array([shifted(line, side * lane.width / 2)[-1] for side in (-1, 1)]), yields


def _keeps_to_kerb(intersection: Intersection, lane: Lane) -> bool:
    """Whether everybody on a lane turns to the kerb."""
    served = [intersection.movements[name] for name in lane.movements]
    return bool(served) and all(movement.keeps_to_kerb for movement in served)


def turns(intersection: Intersection, lane: Lane) -> str:
    """The turns that a lane serves, as in ``"CL"``."""
    return "".join(sorted({intersection.movements[name].turn for name in lane.movements}))


def arrows(intersection: Intersection) -> Iterator[Points]:
    """The turns that each incoming lane serves, as outlines of what is painted on the road."""
    for lane in intersection.lanes.values():
        part = stretch(points(lane.shape), ARROW_SETBACK, ARROW_SETBACK + ARROW_LENGTH)
        if part is not None:
            length = float(np.linalg.norm(part[-1] - part[0]))
            foot = RoadPlace(part[0], (part[-1] - part[0]) / length)
            back = 1 if intersection.driving_side == "right" else -1
            for piece in _arrow(turns(intersection, lane), back):
                scaled = piece * (lane.width / 3.2, length / ARROW_LENGTH)
                yield np.array([foot.at(right, ahead) for right, ahead in scaled])


U_TURN = ((0.0, 2.2), (0.0, 4.0), (-1.1, 4.0), (-1.1, 2.2))  # m, of a cubic curve


def _arrow(turns: str, back: int) -> Iterator[Points]:
    """The pieces of a painted arrow, 10 m long, on a lane 3.2 m wide; x to the right, y ahead.

    Args:
        turns: that it shows.
        back: 1 where U-turns go round to the left, -1 where to the right.
    """
    stem, start = 0.36, np.array([0.0, 0.0])
    if "C" in turns:
        yield ribbon(np.array([start, [0.0, 7.0]]), stem)
        yield np.array([[-0.75, 6.8], [0.75, 6.8], [0.0, 10.0]])
    if "U" in turns:
        yield ribbon(np.array([start, [0.0, 2.2]]), stem)
        yield ribbon(curve(*(np.array(p) * (back, 1) for p in U_TURN)), stem)
        yield np.array([[-1.6, 2.4], [-0.6, 2.4], [-1.1, 0.8]]) * (back, 1)
    for turn, side in (("L", -1.0), ("R", 1.0)):
        if turn in turns:
            height = 4.4 if "C" in turns else 7.6
            foot, elbow = np.array([0.0, height - 2.4]), np.array([0.0, height])
            yield ribbon(np.array([start, foot]), stem)
            yield ribbon(curve(foot, elbow, elbow, np.array([0.75 * side, height])), stem)
            yield np.array(
                [[0.7 * side, height - 1.6], [0.7 * side, height + 1.6], [1.45 * side, height]]
            )

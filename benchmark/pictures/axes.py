"""The ground of an intersection on matplotlib axes: asphalt, markings, zones, arrows and flows.

Everything is in metres of the network, x to the east and y to the north.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb

from benchmark.control.intersection import Intersection, Lane, Movement
from benchmark.pictures import pavement
from benchmark.pictures.geometry import (
    Points,
    RoadPlace,
    curve,
    directions,
    points,
    shifted,
    stretch,
)
from benchmark.scenario.scenario import Scenario
from benchmark.sumo.ground import RoadLane, Surroundings
from benchmark.sumo.junction import Junction
from benchmark.sumo.saturation import count

COLOURS = ("#0072B2", "#E69F00", "#CC79A7", "#56B4E9")  # by quarter of the compass; Okabe-Ito
GROUND, ASPHALT, PALE_ASPHALT = "#f3f3ee", "#84878c", "#dcdddf"
PAINT, CENTRE_LINE = "#ffffff", "#f5d76e"
CONTROL_TINT, DECISION_TINT = 0.38, 0.85  # share of the approach's colour over asphalt
FLOW_TAIL = 7.0  # m of a flow before the entrance and behind the exit
FLOW_FILL, FLOW_GAP = 0.7, 0.5  # share of a road's width for its flows, and m between them


def on_asphalt(colour: str, tint: float) -> tuple[float, float, float]:
    """A colour as if painted thinly on asphalt."""
    red, green, blue = tint * np.array(to_rgb(colour)) + (1 - tint) * np.array(to_rgb(ASPHALT))
    return float(red), float(green), float(blue)


def spread(wanted: Sequence[float], sizes: Sequence[float]) -> list[float]:
    """Centres of things in a row, as near to where they are wanted as they fit without overlap."""
    from scipy.optimize import isotonic_regression

    steps = np.concatenate([[0.0], np.cumsum([(a + b) / 2 for a, b in pairwise(sizes)])])
    return [float(centre) for centre in isotonic_regression(np.array(wanted) - steps).x + steps]


@dataclass(frozen=True)
class Flow:
    """A movement's volume as a band through the intersection."""

    movement: str
    approach: str
    volume: float  # veh/h
    width: float  # m
    line: Points
    place: float  # m to the right of its approach's middle


@dataclass(frozen=True)
class Scene:
    """One intersection with everything that a drawing of it needs."""

    scenario: Scenario
    junction: Junction
    ground: Surroundings

    @property
    def intersection(self) -> Intersection:
        """The facts of the intersection."""
        return self.junction.intersection

    @cached_property
    def approaches(self) -> dict[str, list[Lane]]:
        """The incoming lanes of each approach, from the kerb."""
        approaches: dict[str, list[Lane]] = {}
        for lane in self.intersection.lanes.values():
            approaches.setdefault(lane.approach, []).append(lane)
        return approaches

    @cached_property
    def colours(self) -> dict[str, str]:
        """The colour of each approach and its movements, by the way it leads."""
        free = list(COLOURS)
        colours = {}
        for name, entrance in self.entrances.items():
            east, north = entrance.ahead
            quarter = COLOURS[round(np.arctan2(east, north) / (np.pi / 2)) % 4]
            colours[name] = quarter if quarter in free else free[0]
            free.remove(colours[name])
            free = free or list(COLOURS)
        return colours

    @cached_property
    def middle(self) -> tuple[Points, float]:
        """The centre, and how far the farthest entrance or exit is from it to a side [m]."""
        return pavement.middle(self.intersection)

    @property
    def centre(self) -> Points:
        """The middle of the box around all entrances and exits."""
        return self.middle[0]

    @property
    def radius(self) -> float:
        """From the centre to the farthest side of that box [m]."""
        return self.middle[1]

    @cached_property
    def entrances(self) -> dict[str, RoadPlace]:
        """Where each approach enters."""
        return {
            name: RoadPlace.of([lane.shape for lane in lanes], -1)
            for name, lanes in self.approaches.items()
        }

    @cached_property
    def exits(self) -> dict[str, RoadPlace]:
        """Where each road leaves."""
        names = sorted({movement.exit for movement in self.intersection.movements.values()})
        return {name: RoadPlace.of([lane.shape for lane in self.road(name)], 0) for name in names}

    def road(self, name: str) -> list[RoadLane]:
        """The lanes of a road, from the kerb."""
        lanes = [lane for lane in self.ground.lanes.values() if lane.road == name]
        return sorted(lanes, key=lambda lane: lane.index)

    @cached_property
    def flows(self) -> list[Flow]:
        """The movements' volumes in the peak period, the widest first."""
        bands = _Bands(self)
        flows = map(bands.flow, self.intersection.movements.values())
        return sorted(flows, key=lambda flow: -flow.volume)


class _Bands:
    """Places flows side by side at entrances and exits."""

    def __init__(self, scene: Scene) -> None:
        self.scene, intersection = scene, scene.intersection
        self.movements = intersection.movements.values()
        self.volumes = {
            name: count(scene.scenario, intersection, name) for name in intersection.movements
        }
        self.scale = self._scale()
        approaches = [movement.approach for movement in self.movements]
        self.entering = self._places(scene.entrances, approaches, 0)
        self.leaving = self._places(scene.exits, [m.exit for m in self.movements], -1)

    def _scale(self) -> float:
        """Metres of width per veh/h, so that the flows of every road fit it."""
        totals: defaultdict[str, float] = defaultdict(float)
        for movement in self.movements:
            totals[movement.approach] += self.volumes[movement.id]
            totals[movement.exit] += self.volumes[movement.id]
        widths = {road: sum(lane.width for lane in self.scene.road(road)) for road in totals}
        return FLOW_FILL * min(widths[road] / max(total, 1) for road, total in totals.items())

    def _places(
        self, gates: dict[str, RoadPlace], roads: Sequence[str], end: int
    ) -> dict[str, float]:
        """How far right of its road's middle each movement enters (0) or leaves (-1) [m].

        Args:
            gates: where roads enter or leave.
            roads: that of each movement.
            end: of the movements' ways.
        """
        places: dict[str, float] = {}
        for name, gate in gates.items():
            row = [m for road, m in zip(roads, self.movements, strict=True) if road == name]
            order = self.scene.intersection.turns_abreast
            row.sort(key=lambda movement: order.index(movement.turn))
            wanted = [
                float(np.mean([gate.beside(points(way.shape)[end]) for way in movement.ways]))
                for movement in row
            ]
            widths = [self.volumes[movement.id] * self.scale + FLOW_GAP for movement in row]
            centres = spread(wanted, widths)
            places |= {m.id: centre for m, centre in zip(row, centres, strict=True)}
        return places

    def flow(self, movement: Movement) -> Flow:
        """The band of a movement."""
        entrance, exit_ = self.scene.entrances[movement.approach], self.scene.exits[movement.exit]
        place, leave = self.entering[movement.id], self.leaving[movement.id]
        start, end = entrance.at(place, 0.0), exit_.at(leave, 0.0)
        handle = 0.39 * float(np.linalg.norm(end - start))  # a right angle becomes a quarter circle
        bend = curve(start, entrance.at(place, handle), exit_.at(leave, -handle), end)
        line = np.vstack([entrance.at(place, -FLOW_TAIL), bend, exit_.at(leave, FLOW_TAIL)])
        volume = self.volumes[movement.id]
        return Flow(movement.id, movement.approach, volume, volume * self.scale, line, place)


def draw_asphalt(axes: Axes, scene: Scene, colour: str) -> None:
    """Lanes and the areas where roads meet."""
    shapes = pavement.asphalt(scene.ground)
    axes.add_collection(PolyCollection(shapes, facecolor=colour, edgecolor=colour, linewidth=0.6))


def draw_zones(axes: Axes, scene: Scene) -> None:
    """The control and the decision zone along the incoming lanes, in the approaches' colours."""
    zones = scene.intersection.control_zone, scene.intersection.decision_zone
    for reach, tint in zip(zones, (CONTROL_TINT, DECISION_TINT), strict=True):
        for approach, shape in pavement.zone(scene.junction, scene.ground, reach):
            shade = on_asphalt(scene.colours[approach], tint)
            axes.add_collection(PolyCollection([shape], facecolor=shade, edgecolor="none"))


def draw_markings(axes: Axes, scene: Scene) -> None:
    """Lane lines and centre lines of all roads, and the arrows painted before the entrance."""
    between, middle = pavement.lines(scene.ground)
    dashes = [(0, (5, 4))]
    axes.add_collection(LineCollection(between, colors=PAINT, linewidths=0.6, linestyles=dashes))
    axes.add_collection(LineCollection(middle, colors=CENTRE_LINE, linewidths=0.9))
    shapes = list(pavement.arrows(scene.intersection))
    axes.add_collection(PolyCollection(shapes, facecolor=PAINT, edgecolor="none"))


def draw_stop_lines(axes: Axes, scene: Scene) -> None:
    """A bar across each incoming lane; dashes where a slip lane yields instead."""
    for ends, yields in pavement.stop_lines(scene.scenario, scene.intersection):
        pattern = (0, (0.7, 0.7)) if yields else "solid"
        axes.plot(*ends.T, color=PAINT, linewidth=1.6, linestyle=pattern)


def draw_flows(axes: Axes, scene: Scene, reach: float) -> None:
    """The movements' volumes as bands as wide as their turning counts, in a view of a reach [m]."""
    for flow in scene.flows:
        if flow.volume:
            looks: Any = {"facecolor": scene.colours[flow.approach], "edgecolor": PAINT}
            band = PolyCollection([_with_head(flow, reach)], linewidth=0.4, zorder=3, **looks)
            axes.add_collection(band)


def _with_head(flow: Flow, reach: float) -> Points:
    """A band that ends in an arrow's head, no smaller than the view can show."""
    head = min(max(1.2 * flow.width, 0.045 * reach), 0.6 * FLOW_TAIL)
    body = stretch(flow.line, head, np.inf)
    assert body is not None
    tip, ahead = flow.line[-1], directions(flow.line)[-1]
    wide = max(flow.width / 2 + 0.006 * reach, 0.016 * reach)
    base = RoadPlace(tip - head * ahead, ahead)
    left, right = shifted(body, -flow.width / 2), shifted(body, flow.width / 2)
    return np.vstack([left, base.at(-wide, 0.0), tip, base.at(wide, 0.0), right[::-1]])

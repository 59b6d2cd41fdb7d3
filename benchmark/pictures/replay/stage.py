"""A recorded episode on matplotlib axes: its ground drawn once, its traffic at any moment.

Colours, and the shapes on vehicles and signal heads, are those of the page (``page/traffic.js``).
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba_array
from matplotlib.text import Text
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from benchmark.pictures.geometry import Points
from benchmark.pictures.replay.motion import Motion, Poses
from benchmark.pictures.replay.trajectories import (
    Collision,
    Ground,
    Outline,
    Silhouette,
    Told,
    Trajectories,
)
from benchmark.pictures.sheet.sheet import extent, plain
from benchmark.reports.words import percent

AROUND = 55.0  # m shown beyond the entrances
GAP = 6.0  # pixels beside words
AFTERGLOW = 4.0  # s that a collision stays marked
EVEN = 0.05  # m/s2, within which a Drive holds its speed

INK, QUIET = "#ecebe6", "#a2abad"
FIELD, ASPHALT, BLACK, WHITE = "#20282a", "#3b4043", "#15191b", "#ffffff"
RV, HV, GLASS, CRASH = "#e0352b", "#f5f5f1", "#141a1eb8", "#ff4fd8"
CONTROL, DECISION, UNREGULATED = "#6eafdc21", "#6eafdc3d", "#ffbe284d"
PAINT, CENTRE_LINE, STOP_LINE = "#ffffff73", "#d8b13c", "#f4f4f0"
RINGS = {
    "go": "#4fd37f",
    "stop": "#ffb224",
    "held": "#c08bff",
    "faster": "#4cc9f0",
    "slower": "#ffb224",
    "even": "#9fb0b8",
}
GREEN, YELLOW, RED, DARK = "#3ddc74", "#ffd23f", "#ff5a4a", "#8a8f92"
AFTER_A_STOP = "#ffb224"  # right on red
LIGHTS = {"G": GREEN, "g": GREEN, "y": YELLOW, "u": YELLOW, "r": RED, "s": AFTER_A_STOP}

DISC = np.column_stack([np.sin(turn := np.linspace(0, 2 * np.pi, 17)[:-1]), np.cos(turn)])

Patch = tuple[Points, str]  # an outline and what fills it


class Stage:
    """An episode seen from above, with words over it.

    Args:
        axes: where to draw, on a figure with 72 dots per inch: there a point is a pixel.
        kept: what to show.
        bar: room for words above the axes [pixels].
    """

    def __init__(self, axes: Axes, kept: Trajectories, bar: float) -> None:
        self.kept, self._axes, self._motion = kept, axes, Motion.of(kept)
        self._pixel = _window(axes, kept.ground)  # m
        self._draw_ground(kept.ground)
        self._traffic = PolyCollection([], edgecolor="none", animated=True)
        axes.add_collection(self._traffic, autolim=False)
        size = 2 * max(2.2 / self._pixel, 9.0)  # pixels
        self._collisions = [
            axes.plot([], [], sign, color=colour, ms=size, mew=width, mfc="none", animated=True)[0]
            for colour, width in ((BLACK, 5), (CRASH, 3))
            for sign in "ox"
        ]
        self._figures = self._words(bar)

    def show(self, time: float) -> None:
        """Draw the traffic of a moment [s] on the ground."""
        step = min(max((time - self.kept.start) / self.kept.step, 0.0), self.kept.steps - 1.0)
        patches = list(self._patches(step))
        self._traffic.set_verts([shape for shape, _ in patches])
        self._traffic.set_facecolor([colour for _, colour in patches])
        meetings = np.reshape(list(self._meetings(step)), (-1, 2))
        for mark in self._collisions:
            mark.set_data(*meetings.T)
        self._figures.set_text(f"{self._waiting(int(step))}  {time:.0f} s")
        for artist in (self._traffic, *self._collisions, self._figures):
            self._axes.draw_artist(artist)

    def _words(self, bar: float) -> Text:
        """Write who drives over the axes; the text that follows the moment."""
        left, right = self._axes.bbox.x0 + GAP, self._axes.bbox.x1 - GAP
        looks: dict[str, Any] = {"fontsize": min(bar / 2, (right - left) / 22)}
        record = self.kept.record
        rate = "" if record.rate is None else f", {percent(record.rate)} RVs"
        words = plain(f"{record.controller}{rate}")
        room = right - left - extent("  no one waits  0000 s", looks["fontsize"])[0]
        while words and extent(words, looks["fontsize"])[0] > room:
            words = words[:-1]
        looks |= {"y": self._axes.bbox.y1 + bar / 2, "transform": IdentityTransform()}
        looks["va"] = "center_baseline"
        self._axes.text(left, s=words, color=INK, **looks)
        return self._axes.text(right, s="", color=QUIET, ha="right", animated=True, **looks)

    def _waiting(self, step: int) -> str:
        """The mean waiting of the vehicles in all control zones."""
        waiting = np.array([curves.waiting[step] for curves in self.kept.curves])
        vehicles = [curves.movement_vehicles[:, step].sum() for curves in self.kept.curves]
        if not sum(vehicles):
            return "no one waits"
        return f"waiting {np.average(np.nan_to_num(waiting), weights=vehicles):.1f} s"

    def _draw_ground(self, ground: Ground) -> None:
        self._fill(ground.asphalt, ASPHALT, edgecolor=ASPHALT)  # which seals what rounding opens
        self._fill(ground.control_zone, CONTROL)
        self._fill(ground.decision_zone, DECISION)
        self._lines(ground.lane_lines, PAINT, 0.12, (3.0, 4.5))
        self._lines(ground.centre_lines, CENTRE_LINE, 0.14)
        self._fill(ground.arrows, PAINT)
        for bar in ground.stop_lines:
            colour, dashes = (PAINT, (0.6, 0.4)) if bar.yields else (STOP_LINE, None)
            self._lines([list(bar.ends)], colour, 0.45, dashes)

    def _fill(self, shapes: Sequence[Outline], colour: str, edgecolor: str = "none") -> None:
        outlines = PolyCollection(shapes, facecolor=colour, edgecolor=edgecolor)
        outlines.set_linewidth(0.3 / self._pixel)
        self._axes.add_collection(outlines)

    def _lines(
        self,
        lines: Sequence[Outline],
        colour: str,
        width: float,
        dashes: tuple[float, float] | None = None,
    ) -> None:
        """Draw lines with a width and dashes in metres, a pixel wide at least."""
        wide = max(width / self._pixel, 1.0)
        drawn = LineCollection(lines, colors=colour, linewidths=wide, capstyle="butt")
        if dashes:
            drawn.set_linestyle((0, [length / self._pixel / wide for length in dashes]))
        self._axes.add_collection(drawn)

    def _patches(self, step: float) -> Iterator[Patch]:
        whole = int(step)
        for junction, curves in zip(self.kept.ground.junctions, self.kept.curves, strict=True):
            if self.kept.record.rate is not None:
                for lane, free in zip(junction.regulated_lanes, curves.unregulated, strict=True):
                    if free[whole]:
                        yield np.array(lane.outline), UNREGULATED
            if curves.states:
                state = curves.states[curves.light[whole]]
                for head in junction.heads:
                    size = max(0.42 * head.width, 2.2 * self._pixel)
                    place, heading = np.array(head.place), float(np.radians(head.angle))
                    middle = placed(np.array([(0.0, 1.4)]), place, heading)
                    for shape, colour in _head(state[head.link], size):
                        yield placed(shape, middle, heading), colour
        yield from self._vehicles(self._motion.at(step))

    def _vehicles(self, poses: Poses) -> Iterator[Patch]:
        vehicles, tracks = self.kept.vehicles, self.kept.tracks
        for vehicle, entry, place, heading in zip(
            poses.vehicle, poses.entry, poses.place, poses.heading, strict=True
        ):
            kind = self.kept.classes[vehicles.kind[vehicle]]
            told, acceleration = Told(tracks.told[entry]), float(tracks.acceleration[entry])
            decision = _decision(told, acceleration)
            if told:
                edge = max(0.3, 1.6 * self._pixel)
                yield placed(_around(kind, edge), place, heading), RINGS[decision]
            yield placed(_body(kind), place, heading), RV if vehicles.robot[vehicle] else HV
            yield placed(_glass(kind), place, heading), GLASS
            side, least = int(tracks.side[entry]), 2 * self._pixel
            for sign in _on_roof(decision, acceleration, side, kind, least) if told else ():
                yield placed(sign, place, heading), WHITE

    def _meetings(self, step: float) -> Iterator[Points]:
        """Where vehicles collide or did a moment ago."""
        for collision in self.kept.collisions:
            if collision.first <= step <= collision.last + AFTERGLOW / self.kept.step:
                place = self._meeting(collision, min(step, collision.last))
                if place is not None:
                    yield place

    def _meeting(self, collision: Collision, step: float) -> Points | None:
        """The middle between two vehicles that collide."""
        for moment in (step, float(int(step)), float(collision.first)):
            poses = self._motion.at(moment)
            both = np.isin(poses.vehicle, collision.vehicles)
            if both.sum() == 2:
                return np.asarray(poses.place[both].mean(axis=0))
        return None


def swatches() -> NDArray[np.uint8]:
    """A row of the colours that traffic may bring, as RGB."""
    colours = [RV, HV, CRASH, INK, *RINGS.values(), *LIGHTS.values()]
    return np.round(255 * to_rgba_array(colours)[np.newaxis, :, :3]).astype(np.uint8)


def _window(axes: Axes, ground: Ground) -> float:
    """Show all junctions and some road around them; what a pixel measures there [m]."""
    centres = np.array([junction.centre for junction in ground.junctions])
    reach = np.array([[junction.radius + AROUND] for junction in ground.junctions])
    low, high = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
    across, down = axes.bbox.size
    middle, pixel = (low + high) / 2, float(max((high - low) / (across, down)))
    (left, bottom), (right, top) = (
        middle + side * pixel / 2 * np.array([across, down]) for side in (-1, 1)
    )
    axes.set(xlim=(left, right), ylim=(bottom, top))
    axes.axis("off")
    return pixel


def placed(shape: Points, place: Points, heading: float) -> Points:
    """A shape given to the right and ahead of a place that looks along a heading [rad]."""
    sine, cosine = np.sin(heading), np.cos(heading)
    moved: Points = place + shape @ np.array([[cosine, -sine], [sine, cosine]])
    return moved


def _decision(told: Told, acceleration: float) -> str:
    """What an RV was told, a Drive by the way it changes speed."""
    if told != Told.DRIVE:
        return told.name.lower()
    if abs(acceleration) <= EVEN:
        return "even"
    return "faster" if acceleration > 0 else "slower"


def _body(kind: Silhouette) -> Points:
    """A vehicle's outline; its front bumper's middle is the origin."""
    half, length = kind.width / 2, kind.length
    corner = min(0.28 * kind.width, 0.12 * length)
    right = [
        (half - corner, 0.0),
        (half, -1.4 * corner),
        (half, corner - length),
        (half - corner, -length),
    ]
    return np.array(right + [(-x, y) for x, y in reversed(right)])


def _glass(kind: Silhouette) -> Points:
    """Its windscreen, which shows the way it looks."""
    front, half = -min(0.24 * kind.length, 1.3), 0.39 * kind.width
    return np.array(
        [(0.85 * half, front), (half, front - 0.65), (-half, front - 0.65), (-0.85 * half, front)]
    )


def _around(kind: Silhouette, edge: float) -> Points:
    """What shows around an RV that was told something, as wide as an edge [m]."""
    return _bar(kind.width / 2 + edge, -kind.length - edge, edge)


def _on_roof(
    decision: str, acceleration: float, side: int, kind: Silhouette, least: float
) -> Iterator[Points]:
    """The sign of a decision: an arrow, a bar, both, a beam ahead or back, an arrow aside.

    Args:
        decision: as ``_decision`` has it.
        acceleration: of a Drive [m/s2].
        side: its change of lanes: 1 to the left, -1 to the right.
        kind: the vehicle's class.
        least: half the width of the smallest sign that can be seen [m].
    """
    middle, half = -0.62 * kind.length, max(0.3 * kind.width, least)
    if decision == "go":
        yield _arrow(half, middle - half, middle + half)
    elif decision == "stop":
        yield _bar(half, middle - 0.4 * half, middle + 0.4 * half)
    elif decision == "held":
        yield _arrow(half, middle - 1.5 * half, middle)
        yield _bar(half, middle + 0.4 * half, middle + half)
    elif decision in ("faster", "slower"):
        reach = min(0.36 * kind.length, 0.3 + 0.5 * abs(acceleration))
        yield _bar(0.4 * half, middle, middle + (reach if acceleration > 0 else -reach))
    if side:
        outward = -1.0 if side > 0 else 1.0
        tip, foot = outward * (kind.width / 2 + 1.6 * half), outward * kind.width / 2
        yield np.array([(tip, middle), (foot, middle + 1.3 * half), (foot, middle - 1.3 * half)])


def _head(letter: str, size: float) -> Iterator[Patch]:
    """A signal head: an arrow for green, a bar for red and a dot for yellow, on black."""
    yield 1.25 * size * DISC, BLACK
    if letter == "y":
        sign = 0.62 * size * DISC
    elif letter in "Ggs":
        sign = _arrow(0.85 * size, -0.7 * size, size)
    else:
        sign = _bar(size, -0.4 * size, 0.4 * size)
    yield sign, LIGHTS.get(letter, DARK)


def _arrow(half: float, low: float, high: float) -> Points:
    return np.array([(0.0, high), (half, low), (-half, low)])


def _bar(half: float, low: float, high: float) -> Points:
    return np.array([(half, high), (half, low), (-half, low), (-half, high)])

"""A recorded episode on matplotlib axes: its ground drawn once, its traffic at any moment."""

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
from benchmark.pictures.replay import signs
from benchmark.pictures.replay.motion import Motion, Poses
from benchmark.pictures.replay.signs import BLACK, Patch
from benchmark.pictures.replay.trajectories import (
    Collision,
    Ground,
    Outline,
    Trajectories,
)
from benchmark.pictures.sheet.sheet import extent, plain
from benchmark.reports.words import percent

AROUND = 55.0  # m shown beyond the entrances
GAP = 6.0  # pixels beside words
AFTERGLOW = 4.0  # s that a collision stays marked

INK, QUIET = "#ecebe6", "#a2abad"
FIELD, ASPHALT, CRASH = "#20282a", "#3b4043", "#ff4fd8"
CONTROL, DECISION, UNREGULATED = "#6eafdc21", "#6eafdc3d", "#ffbe284d"
PAINT, CENTRE_LINE, STOP_LINE = "#ffffff73", "#d8b13c", "#f4f4f0"


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
                    heading = float(np.radians(head.angle))
                    for shape, colour in signs.head(state[head.link], size):
                        yield placed(shape, np.array(head.place), heading), colour
        yield from self._vehicles(self._motion.at(step))

    def _vehicles(self, poses: Poses) -> Iterator[Patch]:
        vehicles, tracks = self.kept.vehicles, self.kept.tracks
        for vehicle, entry, place, heading in zip(
            poses.vehicle, poses.entry, poses.place, poses.heading, strict=True
        ):
            patches = signs.vehicle(
                self.kept.classes[vehicles.kind[vehicle]],
                vehicles.robot[vehicle],
                signs.Decision(tracks.told[entry], tracks.acceleration[entry], tracks.side[entry]),
                self._pixel,
            )
            for shape, colour in patches:
                yield placed(shape, place, heading), colour

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
    colours = [CRASH, INK, signs.RV, signs.HV, *signs.RINGS.values(), *signs.LIGHTS.values()]
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

"""One episode as pictures: its ground drawn once, its traffic at any moment."""

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from benchmark.pictures.geometry import Points
from benchmark.pictures.replay.film import signs
from benchmark.pictures.replay.film.motion import Motion, Poses
from benchmark.pictures.replay.film.pen import FINER, Colour, Pen, View, dashes
from benchmark.pictures.replay.trajectories import Collision, JunctionGround, Outline, Trajectories

if TYPE_CHECKING:
    from PIL.Image import Image

AROUND = 55.0  # m shown beyond the entrances
AFTERGLOW = 4.0  # s that a collision stays marked
FIELD: Colour = (32, 40, 42)
ASPHALT: Colour = (59, 64, 67)
RV: Colour = (224, 53, 43)
HV: Colour = (245, 245, 241)
GLASS: Colour = (20, 26, 30, 184)
UNREGULATED: Colour = (255, 190, 40, 77)
CONTROL: Colour = (110, 175, 220, 33)
DECISION: Colour = (110, 175, 220, 61)
PAINT: Colour = (255, 255, 255, 115)
MIDDLE: Colour = (216, 177, 60)
STOP_LINE: Colour = (244, 244, 240)
BLACK: Colour = (21, 25, 27)
CRASH: Colour = (255, 79, 216)


class Scene:
    """An episode seen from above.

    Args:
        kept: what to show.
        size: pixels of a picture, across and down.
    """

    def __init__(self, kept: Trajectories, size: tuple[int, int]) -> None:
        self.kept, self.size = kept, size
        first = kept.ground.junctions[0]
        drawn = (size[0] * FINER, size[1] * FINER)
        scale = min(drawn) / (2 * (first.radius + AROUND))
        self._view = View(np.array(first.centre), scale, drawn)
        self._motion = Motion.of(kept)
        self._bodies = [signs.body(kind) for kind in kept.classes]
        self._glass = [signs.glass(kind) for kind in kept.classes]

    def picture(self, step: float) -> "Image":
        """The picture of a moment, in steps from the first."""
        from PIL.Image import Resampling

        image = self._ground.copy()
        pen = Pen(image, self._view)
        whole, poses = int(step), self._motion.at(step)
        if self.kept.record.rate is not None:
            pen.fill(self._unregulated(whole), UNREGULATED)
        for index, junction in enumerate(self.kept.ground.junctions):
            self._draw_lights(pen, junction, index, whole)
        self._draw_vehicles(pen, poses)
        self._draw_collisions(pen, step)
        return image.resize(self.size, Resampling.BOX)

    @cached_property
    def _ground(self) -> "Image":
        from PIL import Image

        ground = self.kept.ground
        image = Image.new("RGB", self._view.size, FIELD)
        pen = Pen(image, self._view)
        pen.fill(_points(ground.asphalt), ASPHALT)
        pen.line(_points(ground.asphalt), ASPHALT, 0.3, closed=True)  # seals what rounding opens
        pen.fill(_points(ground.control_zone), CONTROL)
        pen.fill(_points(ground.decision_zone), DECISION)
        for line in _points(ground.lane_lines):
            pen.line(dashes(line, 3.0, 4.5), PAINT, 0.12)
        pen.line(_points(ground.centre_lines), MIDDLE, 0.14)
        pen.fill(_points(ground.arrows), PAINT)
        for stop in ground.stop_lines:
            ends = np.array(stop.ends)
            pieces = dashes(ends, 0.6, 0.4) if stop.yields else [ends]
            pen.line(pieces, PAINT if stop.yields else STOP_LINE, 0.45)
        return image

    def _unregulated(self, step: int) -> Iterator[Points]:
        for junction, curves in zip(self.kept.ground.junctions, self.kept.curves, strict=True):
            for lane, free in zip(junction.regulated_lanes, curves.unregulated, strict=True):
                if free[step]:
                    yield np.array(lane.outline)

    def _draw_lights(self, pen: Pen, junction: JunctionGround, index: int, step: int) -> None:
        curves = self.kept.curves[index]
        if not curves.states:
            return
        state = curves.states[curves.light[step]]
        for head in junction.heads:
            letter, angle = state[head.link], np.radians(head.angle)
            size = max(0.42 * head.width, 2.2 * pen.pixel)
            middle = placed(np.array([(0.0, 1.4)]), np.array(head.place), angle)[0]
            colour = signs.LIGHTS.get(letter, signs.DARK)
            pen.dot(middle, 1.25 * size, BLACK)
            shape = signs.head(letter, size)
            if shape is None:
                pen.dot(middle, 0.62 * size, colour)
            else:
                pen.fill([placed(shape, middle, angle)], colour)

    def _draw_vehicles(self, pen: Pen, poses: Poses) -> None:
        kept, tracks = self.kept, self.kept.tracks
        for vehicle, entry, place, heading in zip(
            poses.vehicle, poses.entry, poses.place, poses.heading, strict=True
        ):
            kind, robot = kept.vehicles.kind[vehicle], kept.vehicles.robot[vehicle]
            pen.fill([placed(self._bodies[kind], place, heading)], RV if robot else HV)
            pen.fill([placed(self._glass[kind], place, heading)], GLASS)
            if told := int(tracks.told[entry]):
                acceleration, side = float(tracks.acceleration[entry]), int(tracks.side[entry])
                what, body = signs.spoken(told, acceleration), kept.classes[kind]
                ring = placed(signs.ring(body), place, heading)
                pen.line([ring], signs.RINGS[what], max(0.3, 1.6 * pen.pixel), closed=True)
                roof = signs.on_roof(what, acceleration, side, body, 2 * pen.pixel)
                pen.fill((placed(shape, place, heading) for shape in roof), (255, 255, 255))

    def _draw_collisions(self, pen: Pen, step: float) -> None:
        for one in self.kept.collisions:
            if one.first <= step <= one.last + AFTERGLOW / self.kept.step:
                place = self._meeting(one, min(step, one.last))
                if place is not None:
                    size = max(2.2, 9 * pen.pixel)
                    for colour, width in ((BLACK, 5 * pen.pixel), (CRASH, 3 * pen.pixel)):
                        pen.ring(place, size, colour, width)
                        for slope in (1, -1):
                            arm = size * np.array([1.0, slope])
                            pen.line([np.array([place - arm, place + arm])], colour, width)

    def _meeting(self, one: Collision, step: float) -> Points | None:
        """The middle between two vehicles that collide."""
        for moment in (step, float(int(step)), float(one.first)):
            poses = self._motion.at(moment)
            rows = [np.flatnonzero(poses.vehicle == vehicle) for vehicle in one.vehicles]
            if all(len(row) for row in rows):
                middle: Points = np.mean([poses.place[row[0]] for row in rows], axis=0)
                return middle
        return None


def placed(shape: Points, place: Points, heading: float) -> Points:
    """A shape given to the right and ahead of a place that looks along a heading [rad]."""
    right, ahead = shape[:, 0], shape[:, 1]
    sine, cosine = np.sin(heading), np.cos(heading)
    moved: Points = place + np.column_stack(
        [right * cosine + ahead * sine, ahead * cosine - right * sine]
    )
    return moved


def _points(shapes: list[Outline]) -> list[Points]:
    return [np.array(shape) for shape in shapes]

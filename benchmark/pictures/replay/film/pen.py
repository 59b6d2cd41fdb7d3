"""Draws shapes given in metres into a picture, twice as large as it becomes: smooth edges."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from benchmark.pictures.geometry import Points

if TYPE_CHECKING:
    from PIL.Image import Image

FINER = 2  # pixels drawn for each one of the film
Colour = tuple[int, int, int] | tuple[int, int, int, int]


@dataclass(frozen=True)
class View:
    """What part of the ground a picture shows."""

    centre: Points  # m
    scale: float  # drawn pixels per metre
    size: tuple[int, int]  # drawn pixels

    def pixels(self, shape: Points) -> Points:
        """Places in metres as pixels of what is drawn."""
        flipped: Points = (np.asarray(shape) - self.centre) * (self.scale, -self.scale)
        return flipped + np.asarray(self.size) / 2


class Pen:
    """Draws into one picture; translucent colours blend."""

    def __init__(self, image: "Image", view: View) -> None:
        from PIL import ImageDraw

        self._draw = ImageDraw.Draw(image, "RGBA")
        self._view = view

    def fill(self, shapes: Iterable[Points], colour: Colour) -> None:
        """Fill outlines."""
        for shape in shapes:
            if len(shape) > 2:
                self._draw.polygon(_flat(self._view.pixels(shape)), fill=colour)

    def line(
        self, shapes: Iterable[Points], colour: Colour, width: float, *, closed: bool = False
    ) -> None:
        """Draw lines of a width in metres, a pixel of the film at least."""
        thick = max(FINER, round(width * self._view.scale))
        for shape in shapes:
            places = self._view.pixels(np.vstack([shape, shape[:2]]) if closed else shape)
            self._draw.line(_flat(places), fill=colour, width=thick, joint="curve")

    def dot(self, place: Points, radius: float, colour: Colour) -> None:
        """A filled circle with a radius in metres."""
        x, y = self._view.pixels(place)
        reach = radius * self._view.scale
        self._draw.ellipse((x - reach, y - reach, x + reach, y + reach), fill=colour)

    def ring(self, place: Points, radius: float, colour: Colour, width: float) -> None:
        """A circle with a radius and a width in metres."""
        x, y = self._view.pixels(place)
        reach = radius * self._view.scale
        self._draw.ellipse(
            (x - reach, y - reach, x + reach, y + reach),
            outline=colour,
            width=max(FINER, round(width * self._view.scale)),
        )

    @property
    def pixel(self) -> float:
        """A pixel of the film [m]."""
        return FINER / self._view.scale


def dashes(line: Points, length: float, gap: float) -> list[Points]:
    """A line in pieces [m]."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    starts = np.arange(0.0, along[-1], length + gap)

    def at(place: float) -> Sequence[float]:
        return [float(np.interp(place, along, line[:, axis])) for axis in (0, 1)]

    return [np.array([at(start), at(min(start + length, along[-1]))]) for start in starts]


def _flat(places: Points) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in places]

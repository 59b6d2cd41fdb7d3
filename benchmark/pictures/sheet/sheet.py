"""The page that the parts of a drawing stand on, and how it looks."""

import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

from benchmark.pictures.axes import GROUND, Scene

INK, GREY = "#222222", "#555555"
BARE: dict[str, Any] = {"frameon": False, "borderpad": 0}  # looks of legends
STYLE = {
    "font.family": "sans-serif",
    "font.size": 8.0,
    "text.color": INK,
    "text.usetex": False,
    "text.parse_math": False,  # a scenario's words are words, whatever they hold
    "axes.labelcolor": INK,
    "hatch.linewidth": 1.2,
    "patch.linewidth": 0.0,
    "svg.fonttype": "none",
    "svg.hashsalt": "rightofway",
}

WIDTH, MARGIN, GAP = 12.6, 0.35, 0.5  # in
PLAN, SIDE, HEADING, STRIP = 7.2, 4.2, 0.3, 0.5  # in


@contextmanager
def styled() -> Iterator[None]:
    """What is drawn and saved within looks alike, whatever the user's settings."""
    with matplotlib.style.context(["default", STYLE]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def plain(words: str) -> str:
    """Words on one line, without characters that no font has and no XML allows."""
    return " ".join("".join(c if c.isprintable() else " " for c in words).split())


def lines(words: str, width: int, most: int) -> list[str]:
    """Words in lines of a width, the last one cut off where there are too many."""
    return textwrap.wrap(plain(words), width, max_lines=most, placeholder=" …")


class Sheet:
    """A page in inches from its upper left corner."""

    def __init__(self, height: float, width: float = WIDTH, ground: str = "white") -> None:
        self.height, self.width = height, width
        self.figure = Figure(figsize=(width, height), facecolor=ground)
        FigureCanvasAgg(self.figure)

    def axes(self, left: float, top: float, width: float, height: float) -> Axes:
        """Room for a part."""
        bottom = self.height - top - height
        return self.figure.add_axes(
            (left / self.width, bottom / self.height, width / self.width, height / self.height)
        )

    def text(self, left: float, top: float, words: str, **looks: Any) -> None:
        """Words below and to the right of a place."""
        self.figure.text(left / self.width, 1 - top / self.height, words, va="top", **looks)

    def heading(self, left: float, top: float, letter: str, words: str) -> None:
        """The letter and the title of a part."""
        self.text(left, top, letter, fontsize=10, fontweight="bold")
        self.text(left + 0.2, top, words, fontsize=10)


def extent(words: str, size: float, weight: str = "normal") -> tuple[float, float]:
    """Width and height of words [points]."""
    box = TextPath((0, 0), words, size=size, prop=FontProperties(weight=weight)).get_extents()
    return box.width, box.height


def window(axes: Axes, scene: Scene, reach: float) -> None:
    """A square view of the ground without a frame."""
    x, y = scene.centre
    axes.set(xlim=(x - reach, x + reach), ylim=(y - reach, y + reach), xticks=[], yticks=[])
    axes.set_facecolor(GROUND)
    axes.spines[:].set_visible(False)

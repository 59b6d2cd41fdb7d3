"""How the figures look, and how they are written: the same figure as the same bytes."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, get_args

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from benchmark.plumbing.files import writing

Format = Literal["png", "svg", "pdf"]
FORMATS: tuple[Format, ...] = get_args(Format)
INK, GREY, GRID = "#222222", "#777777", "#dddddd"
COLOURS = ("#E69F00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#000000")
"""Okabe and Ito's, which the colour-blind tell apart; in grey, marks, dashes and hatches do."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
DASHES: tuple[Any, ...] = ("-", "--", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))
HATCHES = ("", "////", "....", "\\\\\\\\", "xx")
SIGNAL_DASHES: tuple[Any, ...] = ("-", ":", (0, (4, 2)), (0, (1, 3)))
SIGNAL_MARKS = ("+", "x", "1", "2")
WIDTH, PANEL = 7.2, 2.7  # in, of a page and of a row of panels
ROOM = 88  # letters that fit beside each other
RESOLUTION = 160  # dots per inch
STYLE = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    "text.color": INK,
    "text.usetex": False,
    "text.parse_math": False,  # a scenario's words are words, whatever they hold
    "axes.labelcolor": INK,
    "axes.titlesize": 9.5,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "hatch.linewidth": 0.7,
    "legend.frameon": False,
    "svg.hashsalt": "rightofway",
    "pdf.fonttype": 42,  # text stays text
}
NO_DATES: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


@contextmanager
def styled() -> Iterator[None]:
    """Everything that is drawn and saved within looks alike, whatever the user's settings."""
    with matplotlib.style.context(["default", STYLE]):
        yield


def save(figure: Figure, target: Path) -> None:
    """Write a figure in the format of its file's name.

    Raises:
        UsageError: the file cannot be written.
    """
    form = target.suffix[1:]
    with writing(target, "the figure", remedy="choose another folder with --out"):
        figure.savefig(target, format=form, dpi=RESOLUTION, metadata=NO_DATES[form])


def panels(
    names: Sequence[str], *, height: float = PANEL, **sharing: Any
) -> tuple[Figure, dict[str, Axes]]:
    """A figure with a panel for each name, two in a row."""
    across = min(2, len(names))
    down = -(-len(names) // across)
    size = (WIDTH, 0.9 + height * down)
    figure = Figure(figsize=size, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(down, across, squeeze=False, **sharing)
    for spare in axes.flat[len(names) :]:
        spare.set_visible(False)
    named = dict(zip(names, axes.flat, strict=False))
    for name, panel in named.items():
        panel.set_title(name, loc="left")
        panel.grid(axis="y", color=GRID, linewidth=0.6)
    return figure, named


def legend(figure: Figure, handles: Sequence[Any], labels: Sequence[str]) -> None:
    """A legend above all panels, in as few rows as its words leave room for."""
    figure.legend(handles, labels, loc="outside upper center", ncols=_across(labels))


def _across(labels: Sequence[str]) -> int:
    """How many columns fit; they are filled from the top, the first ones with one more."""
    for across in range(len(labels), 1, -1):
        full, longer = divmod(len(labels), across)
        rest, words = iter(labels), 0
        for column in range(across):
            words += 7 + max(len(next(rest)) for _ in range(full + (column < longer)))
        if words <= ROOM:
            return across
    return 1


def line(index: int) -> Line2D:
    """How the lines of the controller with this number look."""
    return Line2D(
        [],
        [],
        color=COLOURS[index % len(COLOURS)],
        marker=MARKERS[index % len(MARKERS)],
        linestyle=DASHES[index % len(DASHES)],
        markersize=4.5,
        linewidth=1.4,
    )


def looks(index: int) -> dict[str, Any]:
    """The same, for ``Axes.plot``."""
    sample = line(index)
    return {
        "color": sample.get_color(),
        "marker": sample.get_marker(),
        "linestyle": DASHES[index % len(DASHES)],
        "markersize": 4.5,
        "linewidth": 1.4,
    }


def filling(index: int) -> dict[str, Any]:
    """How the boxes and bars of the controller with this number look."""
    return {
        "facecolor": f"{COLOURS[index % len(COLOURS)]}b0",
        "edgecolor": INK,
        "hatch": HATCHES[index % len(HATCHES)],
        "linewidth": 0.8,
    }


def signal_line(index: int) -> dict[str, Any]:
    """How the line of the signal with this number looks."""
    return {
        "color": INK,
        "linestyle": SIGNAL_DASHES[index % len(SIGNAL_DASHES)],
        "linewidth": 1.0 if index == 0 else 1.6,
    }


def signal_mark(index: int) -> dict[str, Any]:
    """How the point of the signal with this number looks."""
    marker = SIGNAL_MARKS[index % len(SIGNAL_MARKS)]
    return {"color": INK, "linestyle": "", "marker": marker, "markersize": 9}


def logarithmic(axes: Axes, lowest: float, highest: float) -> None:
    """A logarithmic axis of seconds with round numbers on it."""
    ticks = [base * 10.0**power for power in range(-2, 5) for base in (1, 2, 5)]
    axes.set(yscale="log", ylim=(0.8 * lowest, 1.25 * highest))
    axes.yaxis.set_major_locator(FixedLocator(ticks))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())

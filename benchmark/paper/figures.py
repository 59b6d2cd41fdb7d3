"""The paper's two figures of results: box plots of waiting, and unregulated lanes over time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from benchmark import png_file
from benchmark.paper.published import FIGURE_RATE, INTERSECTIONS, METHODS, RATES, SIGNAL, WANG
from benchmark.paper.samples import Samples, junction_of
from benchmark.statistics import estimates
from benchmark.tables import percent

SHOWN = (WANG, *METHODS)
INK, GRID = "#222222", "#dddddd"
COLOURS = dict(zip(SHOWN, ("#E69F00", "#0072B2", "#009E73"), strict=True))  # Okabe-Ito
HATCHES = dict(zip(SHOWN, ("", "", "////"), strict=True))  # tells them apart in grey
DASHES: dict[str, Any] = dict(zip(SHOWN, ("--", "-", "-."), strict=True))
SIGNAL_COLOUR = "#D55E00"
STYLE = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    "text.color": INK,
    "text.usetex": False,
    "axes.labelcolor": INK,
    "axes.titlesize": 9.5,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "hatch.linewidth": 0.7,
}
BOX, APART = 0.22, 0.27  # width of a box and between centres; a rate is 1 wide
SHORTEST = 0.1  # s; a logarithmic axis has no zero
TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)  # s
BIN = 10.0  # s of an entry of a record's curve


def write(samples: Samples, waiting: Path, unregulated: Path) -> None:
    """Draw both figures; the same records give the same bytes.

    Args:
        samples: what to show; what is missing is left out.
        waiting: the PNG of box plots.
        unregulated: the PNG of unregulated lanes.

    Raises:
        UsageError: a file cannot be written.
    """
    with matplotlib.style.context(["default", STYLE]):
        png_file.save(waiting_figure(samples), waiting)
        png_file.save(unregulated_figure(samples), unregulated)


def _panels(height: float, **sharing: Any) -> tuple[Figure, dict[str, Axes]]:
    """A figure with a panel for each intersection."""
    figure = Figure(figsize=(7.2, height), facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2, sharex=True, sharey=True, **sharing)
    panels = dict(zip(INTERSECTIONS, axes.flat, strict=True))
    for intersection, panel in panels.items():
        panel.set_title(f"Intersection {intersection}", loc="left")
        panel.grid(axis="y", color=GRID, linewidth=0.6)
    return figure, panels


def waiting_figure(samples: Samples) -> Figure:
    """Average waiting time by rate: a box for each controller, a line for the deployed signal.

    The axis is logarithmic, so that boxes of a few seconds stay readable beside episodes that
    jammed, and these are shown where they are.
    """
    figure, panels = _panels(6.2)
    highest = lowest = 10.0
    for intersection, axes in panels.items():
        for values in _boxes(axes, samples, intersection):
            highest, lowest = max(highest, *values), min(lowest, *values)
        for value in _signal_line(axes, samples, intersection):
            highest, lowest = max(highest, value), min(lowest, value)
    for axes in panels.values():
        axes.set(yscale="log", ylim=(0.8 * lowest, 1.25 * highest), xlim=(-0.5, len(RATES) - 0.5))
        axes.set_xticks(range(len(RATES)), [percent(rate) for rate in RATES])
        axes.yaxis.set_major_locator(FixedLocator(TICKS))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_locator(NullLocator())
    figure.supxlabel("RV penetration rate", fontsize=9)
    figure.supylabel("average waiting time [s], logarithmic", fontsize=9)
    line = Line2D([], [], color=SIGNAL_COLOUR, linestyle=":", linewidth=1.8)
    boxes = [Patch(**_looks(name)) for name in SHOWN]
    _legend(figure, [*boxes, line], [*SHOWN, f"{SIGNAL} (deployed)"])
    return figure


def _looks(name: str) -> dict[str, Any]:
    return {
        "facecolor": f"{COLOURS[name]}b0",
        "edgecolor": INK,
        "hatch": HATCHES[name],
        "linewidth": 0.8,
    }


def _legend(figure: Figure, handles: Sequence[Any], labels: Sequence[str]) -> None:
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)


def _boxes(axes: Axes, samples: Samples, intersection: str) -> list[list[float]]:
    """The boxes of one panel; returns the values they show [s]."""
    drawn = []
    for place, name in enumerate(SHOWN):
        by_rate = [samples.values("average_waiting_time", name, intersection, r) for r in RATES]
        shown = [
            (index + (place - 1) * APART, [max(value, SHORTEST) for value in values.values()])
            for index, values in enumerate(by_rate)
            if values
        ]
        if shown:
            centres, values = zip(*shown, strict=True)
            _box(axes, name, centres, values)
            drawn += list(values)
    return drawn


def _box(
    axes: Axes, name: str, centres: Sequence[float], values: Sequence[Sequence[float]]
) -> None:
    line = {"color": INK, "linewidth": 0.8}
    outlier = {"marker": "o", "markersize": 2.8, "markeredgewidth": 0.6}
    axes.boxplot(
        values,
        positions=centres,
        widths=BOX,
        patch_artist=True,
        manage_ticks=False,
        boxprops=_looks(name),
        medianprops={"color": INK, "linewidth": 1.6},
        whiskerprops=line,
        capprops=line,
        flierprops={**outlier, "markerfacecolor": COLOURS[name], "markeredgecolor": INK},
    )


def _signal_line(axes: Axes, samples: Samples, intersection: str) -> list[float]:
    """The mean of the deployed signal, if there is one [s]."""
    found = samples.estimate("average_waiting_time", SIGNAL, intersection, RATES[0])
    if found is None:
        return []
    axes.axhline(found.mean, color=SIGNAL_COLOUR, linestyle=":", linewidth=1.8)
    return [found.mean]


def unregulated_figure(samples: Samples) -> Figure:
    """Unregulated lanes over time at one rate: means over seeds with 95 % intervals."""
    figure, panels = _panels(5.0)
    for intersection, axes in panels.items():
        for name in SHOWN:
            _curve(axes, samples, intersection, name)
        axes.set(ylim=(0, 1.02), xlim=(0, None))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.0f} %"))
    figure.supxlabel("time [s]", fontsize=9)
    figure.supylabel(f"unregulated lanes at {percent(FIGURE_RATE)} RVs", fontsize=9)
    handles = [Line2D([], [], color=COLOURS[n], linestyle=DASHES[n], linewidth=1.6) for n in SHOWN]
    _legend(figure, handles, SHOWN)
    return figure


def _curve(axes: Axes, samples: Samples, intersection: str, name: str) -> None:
    records = samples.ok(name, intersection, FIGURE_RATE).values()
    curves = [junction_of(record).unregulated_lane_curve for record in records]
    if not any(curves):
        return
    found = estimates(list(zip(*curves, strict=True)))
    middles = BIN * (np.arange(len(found)) + 0.5)
    lows = [one.mean if one.low is None else one.low for one in found]
    highs = [one.mean if one.high is None else one.high for one in found]
    axes.fill_between(middles, lows, highs, color=COLOURS[name], alpha=0.22, linewidth=0)
    means = [one.mean for one in found]
    axes.plot(middles, means, color=COLOURS[name], linestyle=DASHES[name], linewidth=1.4)

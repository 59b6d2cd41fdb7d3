"""Waiting by penetration rate, as in the paper's figure of overall results, and throughput."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from benchmark.records.measures import HEADLINE
from benchmark.records.statistics import estimates
from benchmark.reports.plots import style
from benchmark.reports.plots.data import Data
from benchmark.reports.words import percent

SHORTEST = 0.1  # s; a logarithmic axis has no zero
ROOM = 0.8  # of the distance between rates, for boxes


def boxes(data: Data) -> Figure | None:
    """A box over seeds for each controller and rate; a line for each signal's mean.

    The axis is logarithmic, so that boxes of a few seconds stay readable beside episodes that
    jammed, and these are shown where they are.
    """
    figure, panels = style.panels(data.scenarios, sharex=True, sharey=True)
    shown: list[float] = []
    for scenario, axes in panels.items():
        for place, name in enumerate(data.controllers):
            shown += _boxes(axes, data, scenario, place, name)
        for place, name in enumerate(data.signals):
            if values := data.signal(HEADLINE.key, scenario, name):
                mean = max(float(np.mean([*values.values()])), SHORTEST)
                axes.axhline(mean, **style.signal_line(place))
                shown.append(mean)
    if not shown:
        return None
    for axes in panels.values():
        style.logarithmic(axes, min(shown), max(shown))
        axes.set_xlim(-0.5, max(len(data.rates), 1) - 0.5)
        axes.set_xticks(range(len(data.rates)), [percent(rate) for rate in data.rates])
        axes.tick_params(axis="x", labelsize=8 if len(data.rates) < 7 else 6.5)
    figure.supxlabel("RV penetration rate", fontsize=9)
    figure.supylabel("average waiting time [s], logarithmic", fontsize=9)
    style.legend(
        figure,
        [
            *(Patch(**style.filling(place)) for place in range(len(data.controllers))),
            *(Line2D([], [], **style.signal_line(place)) for place in range(len(data.signals))),
        ],
        [*data.controllers, *data.signals],
    )
    return figure


def _boxes(axes: Axes, data: Data, scenario: str, place: int, name: str) -> list[float]:
    """The boxes of a controller; the values that they show [s]."""
    apart = ROOM / len(data.controllers)
    boxes = [
        (index + (place + 0.5) * apart - ROOM / 2, [max(s, SHORTEST) for s in values.values()])
        for index, rate in enumerate(data.rates)
        if (values := data.values(HEADLINE.key, scenario, rate, name))
    ]
    if not boxes:
        return []
    centres, shown = zip(*boxes, strict=True)
    thin = {"color": style.INK, "linewidth": 0.7}
    outlier = {"marker": "o", "markersize": 2.2, "markeredgewidth": 0.4}
    fill = style.filling(place)
    axes.boxplot(
        shown,
        positions=centres,
        widths=0.85 * apart,
        patch_artist=True,
        manage_ticks=False,
        boxprops=fill,
        medianprops={"color": style.INK, "linewidth": 1.3},
        whiskerprops=thin,
        capprops=thin,
        flierprops={**outlier, "markerfacecolor": fill["facecolor"], "markeredgecolor": style.INK},
    )
    return [seconds for box in shown for seconds in box]


def throughput(data: Data) -> Figure | None:
    """Mean waiting against mean throughput, along the rates; the last rate is marked larger."""
    figure, panels = style.panels(data.scenarios)
    drawn = False
    for scenario, axes in panels.items():
        for place, name in enumerate(data.controllers):
            points = [*_points(data, scenario, name, data.rates)]
            if points:
                drawn = True
                axes.plot(*zip(*points, strict=True), **style.looks(place))
                axes.plot(*points[-1], **style.looks(place) | {"markersize": 8})
        for place, name in enumerate(data.signals):
            for flow, wait in _points(data, scenario, name, data.rates[:1] or [None]):
                drawn = True
                axes.plot(flow, wait, **style.signal_mark(place))
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_ylim(bottom=0)
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.grid(axis="x", color=style.GRID, linewidth=0.6)
    if not drawn:
        return None
    figure.supxlabel("throughput [veh/h]", fontsize=9)
    figure.supylabel("average waiting time [s], logarithmic above 1", fontsize=9)
    style.legend(
        figure,
        [
            *(style.line(place) for place in range(len(data.controllers))),
            *(Line2D([], [], **style.signal_mark(place)) for place in range(len(data.signals))),
        ],
        [*data.controllers, *data.signals],
    )
    return figure


def _points(
    data: Data, scenario: str, name: str, rates: Sequence[float | None]
) -> Iterator[tuple[float, float]]:
    for rate in rates:
        flows = data.values("throughput", scenario, rate, name)
        waits = data.values(HEADLINE.key, scenario, rate, name)
        if flows and waits:
            flow, wait = estimates([[*flows.values()], [*waits.values()]])
            yield flow.mean, wait.mean

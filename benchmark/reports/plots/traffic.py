"""What records alone hold: unregulated lanes over time, and waiting by movement."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from benchmark.records.statistics import estimates
from benchmark.reports.plots import style
from benchmark.reports.plots.data import Data
from benchmark.reports.words import percent

BIN = 10.0  # s of an entry of a record's curve
ROOM = 0.8  # of the distance between movements, for bars


def unregulated(data: Data) -> Figure | None:
    """The share of unregulated lanes over time: means over seeds with 95 % intervals."""
    figure, panels = style.panels(data.scenarios, sharey=True)
    drawn = False
    for scenario, axes in panels.items():
        for place, name in enumerate(data.controllers):
            junctions = data.junctions(scenario, data.rate, name)
            curves = [junction.unregulated_lane_curve for junction in junctions]
            shortest = min(map(len, curves), default=0)
            if not shortest:
                continue
            drawn = True
            means = estimates([[curve[index] for curve in curves] for index in range(shortest)])
            middles = BIN * (np.arange(shortest) + 0.5)
            looks = style.looks(place) | {"marker": ""}
            axes.fill_between(
                middles,
                [mean.bounds[0] for mean in means],
                [mean.bounds[1] for mean in means],
                color=looks["color"],
                alpha=0.2,
                linewidth=0,
            )
            axes.plot(middles, [mean.mean for mean in means], **looks)
        axes.set(ylim=(0, 1.02), xlim=(0, None))
        axes.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
    if not drawn:
        return None
    figure.supxlabel("time [s]", fontsize=9)
    figure.supylabel(f"unregulated lanes at {percent(data.rate)} RVs", fontsize=9)
    handles = [style.line(place) for place in range(len(data.controllers))]
    for handle in handles:
        handle.set_marker("")
    style.legend(figure, handles, data.controllers)
    return figure


def movements(data: Data) -> Figure | None:
    """Waiting of the vehicles of each movement, also under the signal: means with intervals."""
    shown = [*data.controllers, *data.signals[:1]]
    figure, panels = style.panels(data.scenarios)
    drawn = False
    for scenario, axes in panels.items():
        waits = [
            [each.waiting_by_movement for each in data.junctions(scenario, data.rate, name)]
            for name in shown
        ]
        names = sorted(
            {movement for seeds in waits for by_movement in seeds for movement in by_movement}
        )
        apart = ROOM / max(1, len(shown))
        for place, seeds in enumerate(waits):
            for index, movement in enumerate(names):
                values = [
                    waiting.mean for by_movement in seeds if (waiting := by_movement.get(movement))
                ]
                if values:
                    drawn = True
                    (estimate,) = estimates([values])
                    centre = index + (place + 0.5) * apart - ROOM / 2
                    low, high = estimate.bounds
                    reach = [[estimate.mean - low], [high - estimate.mean]]
                    axes.bar(
                        centre,
                        estimate.mean,
                        0.9 * apart,
                        yerr=reach,
                        error_kw={"elinewidth": 0.7},
                        **style.filling(place),
                    )
        axes.set_xticks(range(len(names)), names)
        axes.tick_params(axis="x", labelsize=7 if len(names) > 6 else 8)
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_ylim(bottom=0)
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    if not drawn:
        return None
    figure.supxlabel("movement: heading, and L left, C across, R right", fontsize=9)
    figure.supylabel(f"waiting at {percent(data.rate)} RVs [s], logarithmic above 1", fontsize=9)
    handles = [Patch(**style.filling(place)) for place in range(len(shown))]
    style.legend(figure, handles, shown)
    return figure

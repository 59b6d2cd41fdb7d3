"""Controllers beside the signal: by how much they wait less, and from which rate on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmark.records.leaderboard import REFERENCE
from benchmark.records.measures import HEADLINE
from benchmark.records.statistics import CONFIDENCE, RANDOM_STATE, RESAMPLES, reductions
from benchmark.reports.plots import style
from benchmark.reports.plots.data import Data
from benchmark.reports.words import percent

Floats = NDArray[np.float64]
REACH = 100.0  # % of the colours; what is worse than twice the signal's is no darker


def improvement(data: Data) -> Figure | None:
    """Reduction of waiting against the signal [%], by scenario, rate and controller."""
    places = [(scenario, rate) for scenario in data.scenarios for rate in data.rates]
    shares = np.full((len(places), len(data.controllers)), math.nan)
    sure = np.zeros(shares.shape, dtype=bool)
    for row, (scenario, rate) in enumerate(places):
        for column, name in enumerate(data.controllers):
            (share,) = reductions([data.paired(HEADLINE.key, scenario, rate, name)])
            if share is not None:
                shares[row, column], sure[row, column] = 100 * share.mean, share.excludes_zero
    if np.isnan(shares).all():
        return None
    figure, (axes,) = _single(len(places), len(data.controllers))
    image = axes.imshow(shares, cmap="PuOr_r", vmin=-REACH, vmax=REACH, aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        text = "-" if math.isnan(share) else f"{share:.0f}{'' if sure[row, column] else '?'}"
        dark = not math.isnan(share) and abs(share) > 60
        axes.text(
            column,
            row,
            text,
            ha="center",
            va="center",
            color="white" if dark else style.INK,
            fontsize=8,
        )
    axes.set_xticks(range(len(data.controllers)), data.controllers, rotation=20, ha="right")
    axes.set_yticks(
        range(len(places)), [f"{scenario}  {percent(rate)}" for scenario, rate in places]
    )
    for edge in range(len(data.rates), len(places), max(len(data.rates), 1)):
        axes.axhline(edge - 0.5, color="white", linewidth=3)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    figure.colorbar(image, ax=axes, fraction=0.04)
    label = f"waiting less than {REFERENCE} [%]\n?: the interval holds zero"
    figure.supxlabel(label, fontsize=8)  # beside the bar it would be longer than few rows are high
    return figure


def _single(rows: int, columns: int) -> tuple[Figure, list[Axes]]:
    figure, panels = style.panels([""], height=0.22 * rows + 0.4)
    figure.set_size_inches(min(style.WIDTH, 3.4 + 0.75 * columns), 1.1 + 0.22 * rows)
    (axes,) = panels.values()
    axes.grid(visible=False)
    return figure, [axes]


@dataclass(frozen=True)
class Crossover:
    """The rate from which a controller waits less than the signal.

    ``-inf``: at every rate that was run; ``inf``: not even at the highest.
    """

    rate: float
    low: float
    high: float


def crossover(rates: Sequence[float], differences: Floats) -> Crossover:
    """Where waiting falls below the signal's for good.

    Between two rates the mean difference is taken to change in a straight line; the crossover is
    the last place where it passes zero. Seeds are resampled, the same at all rates.

    Args:
        rates: rising.
        differences: a controller's waiting minus the signal's [s], a row for each seed, a column
            for each rate.
    """
    count = len(differences)
    drawn = np.random.default_rng(RANDOM_STATE).integers(0, count, (RESAMPLES, count))
    crossings = [_crossing(rates, means) for means in differences[drawn].mean(axis=1)]
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(crossings, [tail, 1 - tail], method="nearest").tolist()
    return Crossover(_crossing(rates, differences.mean(axis=0)), low, high)


def _crossing(rates: Sequence[float], differences: Floats) -> float:
    above = np.flatnonzero(differences >= 0)
    if not len(above):
        return -math.inf
    last = int(above[-1])
    if last == len(rates) - 1:
        return math.inf
    start, end = float(differences[last]), float(differences[last + 1])
    return rates[last] + (rates[last + 1] - rates[last]) * start / (start - end)


def crossovers(data: Data) -> dict[tuple[str, str], Crossover]:
    """Of each scenario and controller that has seeds in common with the signal at two rates."""
    crossings = {}
    for scenario in data.scenarios:
        signal = data.signal(HEADLINE.key, scenario)
        for name in data.controllers:
            by_rate = {rate: data.values(HEADLINE.key, scenario, rate, name) for rate in data.rates}
            run = {rate: values for rate, values in by_rate.items() if values}
            seeds = sorted(set(signal).intersection(*run.values()))
            if len(run) > 1 and seeds:
                differences = [[run[rate][s] - signal[s] for rate in run] for s in seeds]
                crossings[scenario, name] = crossover([*run], np.array(differences))
    return crossings


def crossover_figure(data: Data) -> Figure | None:
    """The crossover of each controller with its interval; arrows point past the rates that ran."""
    crossings = crossovers(data)
    if not crossings:
        return None
    figure, (axes,) = _single(len(crossings) + len(data.scenarios), 6)
    first, last = 100 * data.rates[0], 100 * data.rates[-1]
    heights, labels = [], []
    height = 0
    for scenario in data.scenarios:
        shown = [name for name in data.controllers if (scenario, name) in crossings]
        for name in shown:
            crossing = crossings[scenario, name]
            place = data.controllers.index(name)
            low, rate, high = (
                float(np.clip(100 * each, first, last))
                for each in (crossing.low, crossing.rate, crossing.high)
            )
            looks = style.looks(place) | {"linestyle": "-"}
            axes.plot([low, high], [height, height], **looks | {"marker": ""}, alpha=0.6)
            arrow = {-math.inf: "<", math.inf: ">"}.get(crossing.rate)
            axes.plot(rate, height, **looks | ({"marker": arrow} if arrow else {}))
            heights.append(height)
            labels.append(f"{scenario}  {name}")
            height += 1
        height += 1
    axes.set_xlim(first - 2, last + 2)
    axes.set_yticks(heights, labels)
    axes.invert_yaxis()
    axes.grid(axis="x", color=style.GRID, linewidth=0.6)
    axes.set_xlabel(
        f"RV penetration rate [%] from which waiting is below {REFERENCE}\n"
        "◂: at every rate that was run   ▸: not at the highest"
    )
    return figure

"""The tables of PAPER.md."""

import statistics
from collections.abc import Sequence

from baselines.paper import published
from baselines.paper.published import (
    FIGURE_RATE,
    HIERARCHICAL,
    INTERSECTIONS,
    METHODS,
    RATES,
    TUNED,
    WANG,
    Place,
)
from baselines.paper.reductions import Reduction, Summary, summary, summary_of_paper
from baselines.paper.samples import Samples
from benchmark.records.statistics import Estimate
from benchmark.reports.words import mean_and_interval, percent

RANDOM = "hierarchical?low=random"
PARTS = {
    WANG: "Go and Stop only",
    HIERARCHICAL: "the whole hierarchy",
    TUNED: "the whole hierarchy, tuned",
    "hierarchical?lateral=false&low=forward": "speed zones only",
    RANDOM: "speed zones, low level at random",
    "hierarchical?lateral=false": "no lane changes",
    "hierarchical?zones=false": "no speed zones",
    "hierarchical?top=go": "everybody told to Go",
    "hierarchical?training=1": "another training seed",
    "hierarchical?training=2": "another training seed",
    f"{TUNED}?training=1": "another training seed",
    f"{TUNED}?training=2": "another training seed",
    f"{TUNED}?lateral=false&low=forward": "time windows, nothing below",
    f"{TUNED}?low=random": "time windows, low level at random",
    "time-windows?braking=1": "time windows, their own lane changes",
}
"""What is left of the hierarchy, for people."""

Rows = list[list[str]]


def reduction_table(table: Sequence[Reduction]) -> str:
    """The paper's figure beside ours in each cell [%]."""
    body = []
    for cell in table:
        theirs = r"\*" if cell.published is None else f"{100 * cell.published:.2f}"
        ours = [_share(cell.ours[method]) for method in METHODS]
        body.append([cell.intersection, percent(cell.rate), theirs, *ours])
    return markdown(["intersection", "RVs", "paper", *map(code, METHODS)], body, words=1)


def summary_table(table: Sequence[Reduction]) -> str:
    """What the sixteen cells say together."""
    head = [
        "",
        r"mean, \* as 0 [%]",
        "mean as it is [%]",
        "less waiting in",
        "surely",
        "surely more",
    ]
    body = [["paper", *_summed(summary_of_paper(table))]]
    body += [[code(method), *_summed(summary(table, method))] for method in METHODS]
    return markdown(head, body, words=1)


def _summed(cells: Summary) -> list[str]:
    means = ["-" if m is None else f"{100 * m:.1f}" for m in (cells.stars_as_zero, cells.mean)]
    sure = ["-" if n is None else str(n) for n in (cells.surely_lower, cells.surely_higher)]
    return [*means, f"{cells.lower} of {cells.cells} cells", *sure]


def _share(estimate: Estimate | None) -> str:
    """A reduction in percent with its marks."""
    if estimate is None:
        return "-"
    star = "" if estimate.mean > 0 else r" \*"
    return f"{mean_and_interval(_scaled(estimate, 100), 1)}{star}{doubt(estimate)}"


def doubt(estimate: Estimate) -> str:
    """A mark where the interval does not exclude zero."""
    return "" if estimate.excludes_zero else " n.s."


def _scaled(estimate: Estimate, factor: float) -> Estimate:
    low, high = (
        None if bound is None else factor * bound for bound in (estimate.low, estimate.high)
    )
    return Estimate(factor * estimate.mean, low, high, estimate.count)


def beside_waiting(samples: Samples) -> str:
    """What else happens in each cell, so that nobody creeps or crashes to a low waiting time."""
    head = ["intersection", "RVs", "controller", "waiting [s]", "its median [s]", "its SD [s]"]
    head += ["travel time [s]", "throughput [veh/h]", "collisions with an RV", "seeds"]
    body = [
        [cell[0], percent(cell[1]), code(name), *_beside(samples, name, cell)]
        for cell in published.cells()
        for name in (WANG, *METHODS)
        if samples.seeds(name, cell)
    ]
    return markdown(head, body, words=3)


def _beside(samples: Samples, name: str, cell: Place) -> list[str]:
    def estimate(key: str, digits: int) -> str:
        return mean_and_interval(samples.estimate(key, name, cell), digits)

    waiting = list(samples.values("average_waiting_time", name, cell).values())
    return [
        estimate("average_waiting_time", 1),
        f"{statistics.median(waiting):.1f}" if waiting else "-",
        f"{statistics.stdev(waiting):.1f}" if len(waiting) > 1 else "-",
        estimate("travel_time", 1),
        estimate("throughput", 0),
        estimate("collisions_with_robot", 1),
        str(len(samples.seeds(name, cell))),
    ]


def ablation_table(samples: Samples, intersection: str) -> str:
    """Waiting and travel time of every part of the hierarchy at one intersection."""
    columns = [(key, rate) for key in ("average_waiting_time", "travel_time") for rate in RATES]
    body = []
    for name in _parts(samples):
        if any(samples.seeds(name, (intersection, rate)) for rate in RATES):
            means = [samples.estimate(key, name, (intersection, rate)) for key, rate in columns]
            words = [mean_and_interval(mean, 1) for mean in means]
            body.append([code(name), PARTS.get(name, ""), *words])
    head = ["controller", "what it is"]
    head += [f"{words} [s], {percent(r)}" for words in ("waiting", "travel time") for r in RATES]
    return markdown(head, body, words=2)


def _parts(samples: Samples) -> list[str]:
    """The hierarchy and what is left of it, the known ones first."""
    options = [
        name for name in samples.controllers if name.partition("?")[0] in METHODS and "?" in name
    ]
    return list(dict.fromkeys([*PARTS, *options]))


def unregulated_table(samples: Samples) -> str:
    """The share of unregulated lanes over the evaluation window at the figure's rate."""
    names, key = (WANG, *METHODS), "unregulated_lane_ratio"
    body = []
    for intersection in INTERSECTIONS:
        means = [samples.estimate(key, name, (intersection, FIGURE_RATE)) for name in names]
        body.append([intersection, *(mean_and_interval(mean, 2) for mean in means)])
    return markdown(["intersection", *map(code, names)], body, words=1)


def code(name: str) -> str:
    """A controller's name as Markdown shows it literally."""
    return f"`{name}`"


def markdown(head: Sequence[str], body: Rows, words: int) -> str:
    """A Markdown table; a line instead where it would be empty.

    Args:
        head: of the columns.
        body: the cells, row by row.
        words: how many columns on the left hold words, not figures.
    """
    from tabulate import tabulate

    if not body:
        return "No records yet."
    align = ["left"] * words + ["right"] * (len(head) - words)
    return tabulate(body, head, tablefmt="github", colalign=align, disable_numparse=True)

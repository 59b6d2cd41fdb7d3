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
)
from baselines.paper.reductions import Reduction, Summary, summary, summary_of_paper
from baselines.paper.samples import Samples
from benchmark.records.statistics import Estimate
from benchmark.reports.tables import figure, percent

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
Cell = tuple[str, float]  # intersection and rate


def reduction_table(table: Sequence[Reduction]) -> str:
    """The paper's figure beside ours in each cell [%]."""
    body = [
        [
            *(one.intersection, percent(one.rate)),
            r"\*" if one.published is None else f"{100 * one.published:.2f}",
            *(_share(one.ours[method]) for method in METHODS),
        ]
        for one in table
    ]
    return markdown(["intersection", "RVs", "paper", *map(code, METHODS)], body, words=1)


def summary_table(table: Sequence[Reduction]) -> str:
    """What the sixteen cells say together."""
    found = {"paper": summary_of_paper(table)}
    found |= {code(method): summary(table, method) for method in METHODS}
    head = [
        "",
        r"mean, \* as 0 [%]",
        "mean as it is [%]",
        "less waiting in",
        "surely",
        "surely more",
    ]
    return markdown(head, [[name, *_summed(one)] for name, one in found.items()], words=1)


def _summed(one: Summary) -> list[str]:
    means = ["-" if m is None else f"{100 * m:.1f}" for m in (one.stars_as_zero, one.mean)]
    sure = ["-" if n is None else str(n) for n in (one.surely_lower, one.surely_higher)]
    return [*means, f"{one.lower} of {one.cells} cells", *sure]


def _share(estimate: Estimate | None) -> str:
    """A reduction in percent with its marks."""
    if estimate is None:
        return "-"
    star = "" if estimate.mean > 0 else r" \*"
    return f"{figure(_scaled(estimate, 100), 1)}{star}{doubt(estimate)}"


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
    head = ["intersection", "RVs", "controller", "waiting [s]", "its median [s]"]
    head += [
        "its SD [s]",
        "travel time [s]",
        "throughput [veh/h]",
        "collisions with an RV",
        "seeds",
    ]
    body = [
        [cell[0], percent(cell[1]), code(name), *_beside(samples, name, cell)]
        for cell in published.cells()
        for name in (WANG, *METHODS)
        if samples.ok(name, *cell)
    ]
    return markdown(head, body, words=3)


def _beside(samples: Samples, name: str, cell: Cell) -> list[str]:
    waiting = list(samples.values("average_waiting_time", name, *cell).values())
    deviation = f"{statistics.stdev(waiting):.1f}" if len(waiting) > 1 else "-"
    return [
        figure(samples.estimate("average_waiting_time", name, *cell), 1),
        f"{statistics.median(waiting):.1f}" if waiting else "-",
        deviation,
        figure(samples.estimate("travel_time", name, *cell), 1),
        figure(samples.estimate("throughput", name, *cell), 0),
        figure(samples.estimate("collisions_with_robot", name, *cell), 1),
        str(len(samples.ok(name, *cell))),
    ]


def ablation_table(samples: Samples, intersection: str) -> str:
    """Waiting and travel time of every part of the hierarchy at one intersection."""
    body = [
        [
            *(code(name), PARTS.get(name, "")),
            *(
                figure(samples.estimate(key, name, intersection, rate), 1)
                for key in ("average_waiting_time", "travel_time")
                for rate in RATES
            ),
        ]
        for name in _parts(samples)
        if any(samples.ok(name, intersection, rate) for rate in RATES)
    ]
    head = ["controller", "what it is"]
    head += [f"{words} [s], {percent(r)}" for words in ("waiting", "travel time") for r in RATES]
    return markdown(head, body, words=2)


def _parts(samples: Samples) -> list[str]:
    """The hierarchy and what is left of it, the known ones first."""
    options = [
        one for one in samples.controllers if one.partition("?")[0] in METHODS and "?" in one
    ]
    return list(dict.fromkeys([*PARTS, *options]))


def unregulated_table(samples: Samples) -> str:
    """The share of unregulated lanes over the evaluation window at the figure's rate."""
    body = [
        [
            intersection,
            *(
                figure(
                    samples.estimate("unregulated_lane_ratio", name, intersection, FIGURE_RATE), 2
                )
                for name in (WANG, *METHODS)
            ),
        ]
        for intersection in INTERSECTIONS
    ]
    return markdown(["intersection", *map(code, (WANG, *METHODS))], body, words=1)


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

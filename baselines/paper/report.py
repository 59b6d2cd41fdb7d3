"""The parts of PAPER.md in one text."""

from collections.abc import Container, Iterator
from pathlib import Path

from baselines.paper import missing, tables, worth
from baselines.paper.published import FIGURE_RATE, INTERSECTIONS, SIGNAL, WANG
from baselines.paper.reductions import against
from baselines.paper.samples import Samples
from benchmark.reports.words import percent
from benchmark.study.suite import Suite

WAITING, UNREGULATED, LANE_CHANGE = "waiting.png", "unregulated-lanes.png", "lane-change.png"
"""Files of the figures, beside the report."""

PREFACE = """\
Made by `rightofway paper` from records alone. The paper is *Learning to Change: Choreographing
Mixed Traffic Through Lateral Control and Hierarchical Reinforcement Learning*. Average waiting time
is the mean over the steps of the evaluation window of the mean time that the vehicles in the
control zone have stood there. Figures in [ ] are 95 % bootstrap intervals over seeds."""

REDUCED = """\
1 - mean(ours) / mean(baseline) over the seeds that both have, with the interval of that ratio
paired by seed. \\*: no improvement over the baseline, where the paper prints no figure. n.s.: the
interval does not exclude zero, or there are fewer than six seeds."""

BESIDE = """\
Speed zones let vehicles creep instead of standing, so waiting alone misleads. SD: standard
deviation over seeds of the average waiting time, which a single jam can make large."""

BOXES = """\
A box holds the middle half of the seeds, its bar the median; dots lie beyond 1.5 times the box's
height. The axis is logarithmic, so that episodes that jammed are shown where they are."""

BANDS = """\
Means over seeds of the share of left and cross lanes without an RV, with 95 % intervals as bands;
below, its mean over the evaluation window."""

WORTH = """\
Differences between the same top above two low levels, paired by seed; below zero is better, n.s. as
above. The last line is the mean over the cells, by seed."""


def report(
    samples: Samples, suite: Suite, folder: Path, pictures: Container[str], example: str
) -> str:
    """The whole of PAPER.md; ends in a newline.

    Args:
        samples: what there is.
        suite: what there should be.
        folder: where the records lie, for the commands that make the missing ones.
        pictures: names of the figures that lie beside it.
        example: the section on a lane change, as ``example`` makes it; empty for none.
    """
    sections = [*_overview(samples, suite, folder), *_details(samples, pictures)]
    return "\n\n".join([*sections, example] if example else sections) + "\n"


def example(words: str, *, drawn: bool) -> str:
    """The section on a lane change.

    Args:
        words: what it is, or why there is none, in Markdown.
        drawn: whether there is a drawing of it.
    """
    parts = ["## A lane change that regulates a lane", words]
    drawing = f"![Before and after the lane change]({LANE_CHANGE})"
    return "\n\n".join([*parts, drawing] if drawn else parts)


def _overview(samples: Samples, suite: Suite, folder: Path) -> Iterator[str]:
    yield "# The paper's experiments"
    yield PREFACE
    if gaps := missing.gaps(samples, suite):
        yield "## Missing records"
        yield f"`rightofway run paper --out {folder}` makes all records. By controller:"
        yield "\n".join(missing.lines(gaps, folder))
    yield "## Reduced average waiting time [%]"
    yield REDUCED
    for baseline in (WANG, SIGNAL):
        table = against(samples, baseline)
        yield f"### Compared to `{baseline}`"
        yield tables.summary_table(table)
        yield tables.reduction_table(table)


def _details(samples: Samples, pictures: Container[str]) -> Iterator[str]:
    yield "## Average waiting time"
    if WAITING in pictures:
        yield f"![Average waiting time by penetration rate]({WAITING})"
        yield BOXES
    yield "## Beside waiting"
    yield BESIDE
    yield tables.beside_waiting(samples)
    yield "## What each part is worth"
    for intersection in INTERSECTIONS:
        yield f"### Intersection {intersection}"
        yield tables.ablation_table(samples, intersection)
    yield "### What the low level is worth"
    yield WORTH
    yield worth.legend()
    for key, words in (("average_waiting_time", "Waiting"), ("travel_time", "Travel time")):
        yield f"{words} [s]:"
        yield worth.table(samples, key)
    yield f"## Unregulated lanes at {percent(FIGURE_RATE)} RVs"
    if UNREGULATED in pictures:
        yield f"![Share of unregulated lanes over time]({UNREGULATED})"
        yield BANDS
    yield tables.unregulated_table(samples)

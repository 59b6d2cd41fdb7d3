"""Samples -> by how much waiting is shorter than under a baseline, beside the paper's figures."""

from collections.abc import Sequence
from dataclasses import dataclass

from baselines.paper import published
from baselines.paper.samples import Samples
from benchmark.records.statistics import Estimate, reductions


@dataclass(frozen=True)
class Reduction:
    """One cell of the paper's table: shares, 0.2 for a fifth less waiting."""

    intersection: str
    rate: float
    published: float | None  # None where the paper prints *
    ours: dict[str, Estimate | None]  # by method; None without records of both


@dataclass(frozen=True)
class Summary:
    """What sixteen cells say together; shares of those cells that are there."""

    cells: int  # that are there
    stars_as_zero: float | None  # mean, no improvement counted as 0, as a reader of the paper must
    mean: float | None  # mean of the figures as they are; the paper does not print them
    lower: int  # cells with less waiting than under the baseline
    surely_lower: int | None  # those whose interval says so
    surely_higher: int | None  # cells with more waiting, whose interval says so


def against(samples: Samples, baseline: str) -> list[Reduction]:
    """The paper's half of the table for one baseline.

    Args:
        samples: what there is.
        baseline: ``wang`` or ``traffic-light``.
    """
    cells = list(published.cells())
    ours = {}
    for method in published.METHODS:
        pairs = [samples.paired("average_waiting_time", (method, baseline), cell) for cell in cells]
        ours[method] = reductions([pair or ((), ()) for pair in pairs])
    table = []
    for index, cell in enumerate(cells):
        percentage = published.reduction(baseline, *cell)
        table.append(
            Reduction(
                *cell,
                published=None if percentage is None else percentage / 100,
                ours={method: ours[method][index] for method in published.METHODS},
            )
        )
    return table


def summary_of_paper(table: Sequence[Reduction]) -> Summary:
    """The paper's own figures together."""
    shares = [cell.published for cell in table]
    better = [share for share in shares if share is not None]
    return Summary(len(shares), sum(better) / len(shares), None, len(better), None, None)


def summary(table: Sequence[Reduction], method: str) -> Summary:
    """A method's cells together."""
    ours = [estimate for cell in table if (estimate := cell.ours[method]) is not None]
    shares = [estimate.mean for estimate in ours]
    sure = [estimate.mean for estimate in ours if estimate.excludes_zero]
    return Summary(
        cells=len(ours),
        stars_as_zero=sum(max(share, 0.0) for share in shares) / len(shares) if shares else None,
        mean=sum(shares) / len(shares) if shares else None,
        lower=sum(share > 0 for share in shares),
        surely_lower=sum(share > 0 for share in sure),
        surely_higher=sum(share < 0 for share in sure),
    )

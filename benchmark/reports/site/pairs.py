"""Two controllers against each other: differences paired by seed, in each scenario and rate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean

from benchmark.records.leaderboard import Values
from benchmark.records.measures import COLUMNS, HEADLINE
from benchmark.records.statistics import Estimate, estimates
from benchmark.reports.site.contents import Cell, Contents

Pairs = list[tuple[float, float]]
"""Values of two controllers on the same seeds."""

COMPARED = tuple(one for one in COLUMNS if one.key in (HEADLINE.key, "time_loss"))
"""The figures that are compared: the headline, and what betrays a controller that creeps."""


@dataclass(frozen=True)
class Comparison:
    """Two controllers in one scenario at one rate."""

    scenario: str
    rate: float | None
    means: tuple[float, float]  # of the headline, on the seeds that both have
    differences: dict[str, Estimate]  # by column, the first minus the second

    @property
    def headline(self) -> Estimate:
        """The difference in average waiting time [s]."""
        return self.differences[HEADLINE.key]


@dataclass(frozen=True)
class Tally:
    """In how many cells who waits less, by differences whose intervals exclude zero."""

    first: int
    second: int
    undecided: int


def compare(contents: Contents, first: str, second: str) -> list[Comparison]:
    """All cells in which both have figures on some seeds in common."""
    found = []
    for cell, rows in contents.cells.items():
        if first in rows and second in rows:
            ours, theirs = (contents.samples[*cell, name] for name in (first, second))
            paired = {one.key: _paired(ours[one.key], theirs[one.key]) for one in COMPARED}
            if paired[HEADLINE.key]:
                found.append(_comparison(cell, paired))
    return found


def _comparison(cell: Cell, paired: Mapping[str, Pairs]) -> Comparison:
    used = {key: pairs for key, pairs in paired.items() if pairs}
    differences = estimates([[a - b for a, b in pairs] for pairs in used.values()])
    first, second = (fmean(side) for side in zip(*used[HEADLINE.key], strict=True))
    return Comparison(*cell, (first, second), dict(zip(used, differences, strict=True)))


def _paired(ours: Values, theirs: Values) -> Pairs:
    return [(ours[seed], theirs[seed]) for seed in sorted(ours.keys() & theirs.keys())]


def tally(comparisons: Sequence[Comparison]) -> Tally:
    """Count the cells by who waits less."""
    decided = [one.headline for one in comparisons if one.headline.excludes_zero]
    first = sum(one.mean < 0 for one in decided)
    return Tally(first, len(decided) - first, len(comparisons) - len(decided))

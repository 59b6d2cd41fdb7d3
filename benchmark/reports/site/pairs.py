"""Two controllers against each other: differences paired by seed, in each scenario and rate."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean

from benchmark.records.measures import BY_KEY, HEADLINE
from benchmark.records.samples import Floats
from benchmark.records.statistics import Estimate, estimates
from benchmark.reports.site.contents import Contents, Place

COMPARED = (HEADLINE, BY_KEY["time_loss"])
"""The figures that are compared: the headline, and what betrays a controller that creeps."""


@dataclass(frozen=True)
class Duel:
    """Two controllers in one scenario at one rate."""

    scenario: str
    rate: float | None
    means: tuple[float, float]  # of the headline, on the seeds that both have
    differences: dict[str, Estimate]  # by measure, the first minus the second

    @property
    def headline(self) -> Estimate:
        """The difference in average waiting time [s]."""
        return self.differences[HEADLINE.key]


@dataclass(frozen=True)
class Tally:
    """In how many places who waits less, by differences whose intervals exclude zero."""

    first: int
    second: int
    undecided: int


def duels_of(contents: Contents, first: str, second: str) -> list[Duel]:
    """All places in which both have figures on some seeds in common."""
    duels = []
    for place, rows in contents.places.items():
        if first in rows and second in rows:
            ours, theirs = (contents.samples[*place, name] for name in (first, second))
            paired = {each.key: ours.paired(theirs, each.key) for each in COMPARED}
            if len(paired[HEADLINE.key][0]):
                duels.append(_duel(place, paired))
    return duels


def _duel(place: Place, paired: Mapping[str, tuple[Floats, Floats]]) -> Duel:
    used = {key: pair for key, pair in paired.items() if len(pair[0])}
    differences = estimates([ours - theirs for ours, theirs in used.values()])
    first, second = (fmean(side) for side in used[HEADLINE.key])
    return Duel(*place, (first, second), dict(zip(used, differences, strict=True)))


def tally(duels: Sequence[Duel]) -> Tally:
    """Count the places by who waits less."""
    decided = [duel.headline for duel in duels if duel.headline.excludes_zero]
    first = sum(difference.mean < 0 for difference in decided)
    return Tally(first, len(decided) - first, len(duels) - len(decided))

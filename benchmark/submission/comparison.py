"""Whether a controller does worse on fresh seeds than on those that were submitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from statistics import fmean

import numpy as np
import numpy.typing as npt

from benchmark.naming import place
from benchmark.record import Record

RATIO = 1.1  # of waiting on fresh seeds to waiting on the submitted ones, at least
CHANCE = 0.001  # of a difference as large, were fresh seeds no different, at most
PERMUTATIONS = 9999

Cell = tuple[str, float | None, str]
"""Scenario, rate and junction."""

Waits = Mapping[int, float]
"""Average waiting time by seed [s]."""


@dataclass(frozen=True)
class Comparison:
    """A controller's episodes on submitted seeds, and on fresh ones of the same cells."""

    submitted: Sequence[Record]
    made: Sequence[Record]

    @property
    def speaks_against(self) -> bool:
        """Whether it does worse than chance would have it."""
        return self.fails_more_often or self.waits_longer

    @property
    def can_tell(self) -> bool:
        """Whether there are seeds enough for so small a chance."""
        old, new = ({one.seed for one in some} for some in (self.submitted, self.made))
        return 2 / comb(len(old) + len(new), len(new)) < CHANCE

    @property
    def bad(self) -> list[Record]:
        """The fresh episodes that did not end well."""
        return [one for one in self.made if one.status != "ok"]

    @property
    def fails_more_often(self) -> bool:
        """Whether more fresh episodes end badly than submitted ones would let expect.

        By Fisher's exact test.
        """
        from scipy import stats

        table = [_bad_and_good(some) for some in (self.made, self.submitted)]
        return bool(stats.fisher_exact(table, alternative="greater").pvalue < CHANCE)

    @property
    def waits_longer(self) -> bool:
        """Whether it waits longer in some cell, or a little longer in many."""
        if not self.cells:
            return False
        before, after = self._most[1:]
        return after > RATIO * before and self.chance < CHANCE

    @cached_property
    def cells(self) -> dict[Cell, Waits]:
        """The waiting times of each cell that both have."""
        found: dict[Cell, dict[int, float]] = {}
        for one in (*self.submitted, *self.made):
            for name, junction in one.junctions.items():
                if one.status == "ok" and junction.average_waiting_time is not None:
                    cell = found.setdefault((one.scenario, one.rate, name), {})
                    cell[one.seed] = junction.average_waiting_time
        return {key: cell for key, cell in found.items() if 0 < self._fresh(cell) < len(cell)}

    @cached_property
    def seeds(self) -> list[int]:
        """The fresh ones."""
        return sorted({one.seed for one in self.made})

    def _fresh(self, cell: Waits) -> int:
        return sum(seed in self.seeds for seed in cell)

    @cached_property
    def chance(self) -> float:
        """How often fresh seeds would wait as much longer by chance."""
        return chance_of([*self.cells.values()], self.seeds)

    @cached_property
    def _most(self) -> tuple[Cell, float, float]:
        """The cell that tells most; what it waits there on submitted and fresh seeds [s]."""
        scores, count = _scores([*self.cells.values()], self.seeds)
        key = [*self.cells][int(scores[:-1, :count].sum(axis=1).argmax())]
        new, old = (
            fmean(wait for seed, wait in self.cells[key].items() if (seed in self.seeds) is fresh)
            for fresh in (True, False)
        )
        return key, old, new

    @property
    def words(self) -> str:
        """All of it, for the report."""
        parts = [f"seeds {', '.join(map(str, self.seeds))}"]
        if self.bad:
            one = self.bad[0]
            parts.append(
                f"{len(self.bad)} of {len(self.made)} episodes do not end well, such as "
                f"{place(one.scenario, one.rate, one.seed)}: {one.status}: {one.reason}"
            )
        if self.cells:
            (scenario, rate, _), old, new = self._most
            parts.append(
                f"at {place(scenario, rate)} waits {new:.1f} s, on the submitted ones {old:.1f} s "
                f"(p = {self.chance:.4f})"
            )
        return "; ".join(parts)


def _bad_and_good(records: Sequence[Record]) -> tuple[int, int]:
    good = sum(one.status == "ok" for one in records)
    return len(records) - good, good


def chance_of(cells: Sequence[Waits], new: Sequence[int]) -> float:
    """How often fresh seeds would wait as much longer by chance (one-sided, p).

    A permutation test on ranks within cells: it is drawn anew which seeds count as fresh, in all
    cells alike, as the traffic of a seed may be light or heavy in several. What counts is the cell
    that tells most, or the mean over cells if that tells more. The draws are fixed, so equal
    figures give an equal answer.

    Args:
        cells: for each cell the waiting times by seed.
        new: the seeds that are fresh; the others were submitted, and there are some of both.
    """
    scores, count = _scores(cells, new)
    random = np.random.default_rng(0).random((PERMUTATIONS, scores.shape[1]))
    chosen = (random.argsort(axis=1).argsort(axis=1) < count).astype(np.float64)
    drawn = (chosen @ scores.T).max(axis=1)
    seen = scores[:, :count].sum(axis=1).max()
    return float((1 + np.count_nonzero(drawn >= seen - 1e-9)) / (1 + PERMUTATIONS))


def _scores(cells: Sequence[Waits], new: Sequence[int]) -> tuple[npt.NDArray[np.float64], int]:
    """Ranks with mean 0 and deviation 1: a row for each cell and one for their mean.

    A column for each seed, and how many of them, the first ones, are fresh. A seed that a cell does
    not have counts as an average one.
    """
    every_seed = {seed for cell in cells for seed in cell}
    seeds = sorted(every_seed, key=lambda seed: (seed not in new, seed))
    ranks = np.zeros((len(cells), len(seeds)))
    for row, cell in zip(ranks, cells, strict=True):
        waits = np.array([*cell.values()])
        for index, seed in enumerate(seeds):
            if (wait := cell.get(seed)) is not None:
                row[index] = np.mean(waits < wait) + np.mean(waits <= wait) - 1
    every = np.vstack([ranks, ranks.mean(axis=0)])
    deviations = every.std(axis=1, keepdims=True)
    found: npt.NDArray[np.float64] = np.divide(
        every, deviations, out=np.zeros_like(every), where=deviations > 1e-12
    )
    return found, len(every_seed.intersection(new))

"""Whether a controller does worse on fresh seeds than on those that were submitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from statistics import fmean

import numpy as np
import numpy.typing as npt

from benchmark.control.reference import place
from benchmark.records.record import Record

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
        """Whether there are seeds enough for so small a chance of waiting as much longer."""
        seeds = {seed for cell in self.cells.values() for seed in cell}
        least = 1 / comb(len(seeds), len(seeds.intersection(self.seeds)))
        return 2 * least < CHANCE  # the least one is estimated from draws, too

    @property
    def bad(self) -> list[Record]:
        """The fresh episodes that did not end well."""
        return [record for record in self.made if record.status != "ok"]

    @property
    def fails_more_often(self) -> bool:
        """Whether episodes end badly on more of the fresh seeds than submitted ones let expect.

        By Fisher's exact test on seeds, as an episode that goes wrong may do so in many cells.
        """
        from scipy import stats

        ran = {(record.scenario, record.rate) for record in self.made}
        before = [record for record in self.submitted if (record.scenario, record.rate) in ran]
        table = [_bad_and_good(records) for records in (self.made, before)]
        return bool(stats.fisher_exact(table, alternative="greater").pvalue < CHANCE)

    @property
    def waits_longer(self) -> bool:
        """Whether it waits longer than matters in some cell, or in most, and not by chance."""
        return bool(self._matters.any()) and self.chance < CHANCE

    @cached_property
    def cells(self) -> dict[Cell, Waits]:
        """The waiting times of each cell that both have."""
        cells: dict[Cell, dict[int, float]] = {}
        for record in (*self.submitted, *self.made):
            for name, junction in record.junctions.items():
                if junction.average_waiting_time is not None:
                    cell = cells.setdefault((record.scenario, record.rate, name), {})
                    cell[record.seed] = junction.average_waiting_time
        return {key: cell for key, cell in cells.items() if 0 < self._fresh(cell) < len(cell)}

    @cached_property
    def seeds(self) -> list[int]:
        """The fresh ones."""
        return sorted({record.seed for record in self.made})

    def _fresh(self, cell: Waits) -> int:
        return sum(seed in self.seeds for seed in cell)

    @cached_property
    def _means(self) -> list[tuple[float, float]]:
        """What each cell waits on submitted and on fresh seeds [s]."""
        return [
            (
                fmean(wait for seed, wait in cell.items() if seed not in self.seeds),
                fmean(wait for seed, wait in cell.items() if seed in self.seeds),
            )
            for cell in self.cells.values()
        ]

    @cached_property
    def _matters(self) -> npt.NDArray[np.bool_]:
        """In which cells it waits longer by enough; and, last, whether in most of them."""
        longer = [after > RATIO * before for before, after in self._means]
        return np.array([*longer, 2 * sum(longer) > len(longer)])

    @cached_property
    def _scores(self) -> "tuple[npt.NDArray[np.float64], int]":
        return scores([*self.cells.values()], self.seeds)

    @cached_property
    def chance(self) -> float:
        """How often fresh seeds would wait as much longer by chance."""
        return chance_of(*self._scores, among=self._matters if self._matters.any() else None)

    @property
    def _most(self) -> int:
        """The number of the cell that tells most, of those where it matters if there are any."""
        table, count = self._scores
        told = table[:-1, :count].sum(axis=1)
        matters = self._matters[:-1]
        return int(np.where(matters, told, -np.inf).argmax() if matters.any() else told.argmax())

    @property
    def words(self) -> str:
        """All of it, for the report."""
        parts = [f"seeds {', '.join(map(str, self.seeds))}"]
        if self.bad:
            record = self.bad[0]
            example = place(record.scenario, record.rate, record.seed)
            parts.append(
                f"{len(self.bad)} of {len(self.made)} episodes do not end well, such as "
                f"{example}: {record.status}: {record.reason}"
            )
        if self.cells:
            scenario, rate, junction = [*self.cells][self._most]
            several = len({name for other, _, name in self.cells if other == scenario}) > 1
            where = f"{scenario} {junction}" if several else scenario
            before, after = self._means[self._most]
            parts.append(
                f"at {place(where, rate)} waits {after:.1f} s, on the submitted ones {before:.1f} "
                f"s (p = {self.chance:.4f})"
            )
        return "; ".join(parts)


def _bad_and_good(records: Sequence[Record]) -> tuple[int, int]:
    """How many seeds have an episode that did not end well, and how many have none."""
    every = {record.seed for record in records}
    bad = {record.seed for record in records if record.status != "ok"}
    return len(bad), len(every - bad)


def chance_of(
    table: npt.NDArray[np.float64], count: int, among: npt.NDArray[np.bool_] | None = None
) -> float:
    """How often fresh seeds would wait as much longer by chance (one-sided, p).

    A permutation test on ranks within cells: it is drawn anew which seeds count as fresh, in all
    cells alike, as the traffic of a seed may be light or heavy in several. What counts is the row
    that tells most. The draws are fixed, so equal figures give an equal answer.

    Args:
        table: of scores.
        count: how many of its seeds are fresh, the first ones.
        among: which rows may be the one that was seen to tell most; None for any.
    """
    random = np.random.default_rng(0).random((PERMUTATIONS, table.shape[1]))
    chosen = (random.argsort(axis=1) < count).astype(np.float64)
    drawn = (chosen @ table.T).max(axis=1)
    sums = table[:, :count].sum(axis=1)
    seen = (sums if among is None else sums[among]).max()
    return float((1 + np.count_nonzero(drawn >= seen - 1e-9)) / (1 + PERMUTATIONS))


def scores(cells: Sequence[Waits], new: Sequence[int]) -> tuple[npt.NDArray[np.float64], int]:
    """Ranks with mean 0 and deviation 1: a row for each cell and one for their mean.

    A column for each seed, and how many of them, the first ones, are fresh. A seed that a cell does
    not have counts as an average one.
    """
    from scipy.stats import rankdata

    every_seed = {seed for cell in cells for seed in cell}
    seeds = sorted(every_seed, key=lambda seed: (seed not in new, seed))
    ranks = np.zeros((len(cells), len(seeds)))
    for row, cell in zip(ranks, cells, strict=True):
        columns = [seeds.index(seed) for seed in cell]
        row[columns] = (2 * rankdata([*cell.values()]) - len(cell) - 1) / len(cell)
    every = np.vstack([ranks, ranks.mean(axis=0)])
    deviations = every.std(axis=1, keepdims=True)
    standardised: npt.NDArray[np.float64] = np.divide(
        every, deviations, out=np.zeros_like(every), where=deviations > 1e-12
    )
    return standardised, len(every_seed.intersection(new))

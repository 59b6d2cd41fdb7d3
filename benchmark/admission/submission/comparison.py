"""Whether a controller does worse on fresh seeds than on those that were submitted."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb, exp, inf, log, sqrt
from statistics import NormalDist, fmean

import numpy as np
import numpy.typing as npt

from benchmark.control.reference import place
from benchmark.records.record import Record

RATIO = 1.05  # of waiting on fresh seeds to waiting on the submitted ones, at least
CHANCE = 0.001  # of a difference as large, were fresh seeds no different, at most, in each test
SMALL = 0.025  # a chance that gives reason to look again
POWER = 0.95  # with which a difference is to be found
UNSEEN = 0.5  # the largest difference that a check may miss: this much longer waiting
PERMUTATIONS = 9999
FEW = 6  # seeds that are all named
OFFSET = 0.1  # s, added before logarithms: less is no difference that anybody feels
STEADIEST = 0.01  # the least deviation of a cell's logarithms that is believed

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
    def is_suspicious(self) -> bool:
        """Whether it does worse by so much that more seeds should be asked."""
        longer = bool(self._matters.any()) and self.chance < SMALL
        return self.speaks_against or self.failing_chance < SMALL or longer

    @property
    def has_seeds(self) -> bool:
        """Whether there are seeds enough for so small a chance of waiting as much longer."""
        every = {seed for cell in self.cells.values() for seed in cell}
        least = 1 / comb(len(every), len(every & self._is_fresh))
        return 2 * least < CHANCE  # the least one is estimated from draws, too

    @property
    def can_tell(self) -> bool:
        """Whether a large difference would be found, were there one."""
        return self.has_seeds and self.finds() <= UNSEEN

    def finds(self, more: int = 0) -> float:
        """The least share by which it must wait longer everywhere to be found out, at ``POWER``.

        By the deviation of waiting between seeds, with cells weighted as the test weights them.

        Args:
            more: seeds that are asked besides where these make suspicious.
        """
        deviation, fresh, old = self._deviation
        if not fresh or not old:
            return inf
        stages = [(SMALL, fresh), (CHANCE, fresh + more)] if more else [(CHANCE, fresh)]
        normal = NormalDist()
        return max(
            exp(
                (normal.inv_cdf(1 - chance) + normal.inv_cdf(POWER))
                * deviation
                * sqrt(1 / count + 1 / old)
            )
            - 1
            for chance, count in stages
        )

    @property
    def bad(self) -> list[Record]:
        """The fresh episodes that did not end well."""
        return [record for record in self.made if record.status != "ok"]

    @property
    def fails_more_often(self) -> bool:
        """Whether episodes end badly on more of the fresh seeds than submitted ones let expect."""
        return self.failing_chance < CHANCE

    @cached_property
    def failing_chance(self) -> float:
        """How often as many fresh seeds would end badly by chance.

        By Fisher's exact test on seeds, as an episode that goes wrong may do so in many cells.
        """
        from scipy import stats

        ran = {(record.scenario, record.rate) for record in self.made}
        before = [record for record in self.submitted if (record.scenario, record.rate) in ran]
        table = [_bad_and_good(records) for records in (self.made, before)]
        return float(stats.fisher_exact(table, alternative="greater").pvalue)

    @property
    def waits_longer(self) -> bool:
        """Whether it waits longer than matters in some cell, or in all, and not by chance."""
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
        return sum(seed in self._is_fresh for seed in cell)

    @cached_property
    def _is_fresh(self) -> frozenset[int]:
        return frozenset(self.seeds)

    @cached_property
    def _means(self) -> list[tuple[float, float]]:
        """What each cell waits on submitted and on fresh seeds [s]."""
        return [
            (
                fmean(wait for seed, wait in cell.items() if seed not in self._is_fresh),
                fmean(wait for seed, wait in cell.items() if seed in self._is_fresh),
            )
            for cell in self.cells.values()
        ]

    @cached_property
    def _matters(self) -> npt.NDArray[np.bool_]:
        """In which cells it waits longer by enough; and, last, whether it does in all together."""
        longer = [OFFSET + after > RATIO * (OFFSET + before) for before, after in self._means]
        together = self._overall
        return np.array([*longer, bool(together) and together > log(RATIO)])

    @cached_property
    def _overall(self) -> float:
        """How much longer it waits on fresh seeds in all cells, as a logarithm."""
        if not self.cells:
            return 0.0
        row, count = weighted([*self.cells.values()], self.seeds)
        return float(row[:count].mean() - row[count:].mean())

    @cached_property
    def _deviation(self) -> tuple[float, int, int]:
        """The deviation of waiting between seeds, as a logarithm; how many are fresh, and not."""
        if not self.cells:
            return inf, 0, 0
        row, count = weighted([*self.cells.values()], self.seeds)
        groups = row[:count], row[count:]
        freedom = len(row) - 2
        if freedom < 1:
            return inf, count, len(row) - count
        squares = sum(float(((group - group.mean()) ** 2).sum()) for group in groups)
        return sqrt(squares / freedom), count, len(row) - count

    @cached_property
    def _scores(self) -> "tuple[npt.NDArray[np.float64], int]":
        return scores([*self.cells.values()], self.seeds)

    @cached_property
    def chance(self) -> float:
        """How often fresh seeds would wait as much longer by chance."""
        if not self.cells:
            return 1.0
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
        parts = [_named(self.seeds)]
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


def _named(seeds: Sequence[int]) -> str:
    """Seeds in words: the first three of many."""
    if len(seeds) <= FEW:
        return f"seeds {', '.join(map(str, seeds))}"
    return f"{len(seeds)} seeds, as {', '.join(map(str, seeds[:3]))}"


def compared(submitted: Sequence[Record], draws: Iterable[Sequence[Record]]) -> Comparison:
    """A controller's submitted records against draws of fresh ones, until none is suspicious.

    Args:
        submitted: its records.
        draws: records on fresh seeds; the next are made only where those before make suspicious,
            and then decide together with them.
    """
    made: list[Record] = []
    for draw in draws:
        made += draw
        comparison = Comparison(submitted, made)
        if not comparison.is_suspicious:
            break
    return comparison


def _bad_and_good(records: Sequence[Record]) -> tuple[int, int]:
    """How many seeds have an episode that did not end well, and how many have none."""
    every = {record.seed for record in records}
    bad = {record.seed for record in records if record.status != "ok"}
    return len(bad), len(every - bad)


def chance_of(
    table: npt.NDArray[np.float64], count: int, among: npt.NDArray[np.bool_] | None = None
) -> float:
    """How often fresh seeds would wait as much longer by chance (one-sided, p).

    Permutation tests: it is drawn anew which seeds count as fresh, in all cells alike, as the
    traffic of a seed may be light or heavy in several. The last row is a test of its own; of the
    others that row counts which tells most. The draws are fixed, so equal figures give an equal
    answer.

    Args:
        table: of scores.
        count: how many of its seeds are fresh, the first ones.
        among: which rows may be the one that was seen to tell most; None for any.

    Returns:
        The smaller of the two.
    """
    random = np.random.default_rng(0).random((PERMUTATIONS, table.shape[1]))
    chosen = (random.argsort(axis=1) < count).astype(np.float64)
    drawn, seen = chosen @ table.T, table[:, :count].sum(axis=1)
    allowed = np.ones(len(table), dtype=np.bool_) if among is None else among
    chances = [
        (1 + np.count_nonzero(drawn[:, rows].max(axis=1) >= seen[rows & allowed].max() - 1e-9))
        / (1 + PERMUTATIONS)
        for rows in _tests(len(table))
        if (rows & allowed).any()
    ]
    return float(min(chances))


def _tests(rows: int) -> list[npt.NDArray[np.bool_]]:
    last = np.arange(rows) == rows - 1
    return [~last, last]


def scores(cells: Sequence[Waits], new: Sequence[int]) -> tuple[npt.NDArray[np.float64], int]:
    """Ranks with mean 0 and deviation 1, a row for each cell; and, last, all cells weighted.

    A column for each seed, and how many of them, the first ones, are fresh. A seed that a cell does
    not have counts as an average one.
    """
    from scipy.stats import rankdata

    seeds, count = _columns(cells, new)
    ranks = np.zeros((len(cells), len(seeds)))
    for row, cell in zip(ranks, cells, strict=True):
        row[[seeds[seed] for seed in cell]] = rankdata([*cell.values()]) - (len(cell) + 1) / 2
    every = np.vstack([ranks, weighted(cells, new)[0]])
    deviations = every.std(axis=1, keepdims=True)
    standardised: npt.NDArray[np.float64] = np.divide(
        every, deviations, out=np.zeros_like(every), where=deviations > 1e-12
    )
    return standardised, count


def weighted(cells: Sequence[Waits], new: Sequence[int]) -> tuple[npt.NDArray[np.float64], int]:
    """By seed, the mean over cells of the logarithm of waiting, against each cell's own mean.

    A cell in which seeds differ little weighs more (by inverse variance). Columns as of ``scores``.
    """
    seeds, count = _columns(cells, new)
    total, weights = np.zeros(len(seeds)), 0.0
    for cell in cells:
        logs = np.log(OFFSET + np.array([*cell.values()]))
        weight = max(float(logs.std()), STEADIEST) ** -2
        total[[seeds[seed] for seed in cell]] += weight * (logs - logs.mean())
        weights += weight
    return total / weights, count


def _columns(cells: Sequence[Waits], new: Sequence[int]) -> tuple[dict[int, int], int]:
    """The column of each seed, fresh ones first, and how many these are."""
    fresh, every = frozenset(new), {seed for cell in cells for seed in cell}
    ordered = sorted(every, key=lambda seed: (seed not in fresh, seed))
    return {seed: column for column, seed in enumerate(ordered)}, len(every & fresh)

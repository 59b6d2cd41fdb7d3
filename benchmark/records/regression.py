"""Reference records against new ones -> a verdict per scenario, controller, rate and figure.

Pure: records in, rows out. What stands in docs/regression.md is decided here.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import product

import numpy as np

from benchmark.records.measures import COLUMNS, HEADLINE, Column
from benchmark.records.record import Record
from benchmark.records.statistics import Estimate, estimates


class Verdict(StrEnum):
    """What became of a row; the most urgent first."""

    NEW_FAILURE = "new failure"  # some episode had a figure and has none now
    WORSE = "worse"
    NOT_COMPARABLE = "not comparable"  # the scenario is another, or is gone
    MISSING = "missing"  # the new records lack it
    UNPROVEN = "unproven"  # past the limit, but it may be chance
    FIXED = "fixed"  # some episode had no figure and has one now
    BETTER = "better"
    UNCHANGED = "unchanged"


REGRESSIONS = frozenset({Verdict.NEW_FAILURE, Verdict.WORSE})
URGENCY = {verdict: rank for rank, verdict in enumerate(Verdict)}

ScenarioKey = tuple[str, str]
"""A scenario's name and hash."""


@dataclass(frozen=True)
class Row:
    """One figure of one controller on one scenario at one rate; means are over paired seeds."""

    scenario: str  # with the junction, where the scenario has several
    controller: str
    rate: float | None
    column: Column
    verdict: Verdict
    seeds: int = 0  # that have the figure on both sides
    reference: float | None = None
    new: float | None = None
    difference: Estimate | None = None  # new minus reference, paired by seed
    remark: str = ""

    @property
    def ratio(self) -> float | None:
        """New over reference; None where there is nothing to divide by."""
        if self.reference is None or self.new is None or self.reference <= 0:
            return None
        return self.new / self.reference


@dataclass(frozen=True)
class Comparison:
    """All rows, the most urgent first."""

    rows: tuple[Row, ...]
    limit: float  # as a share: 0.05 for 5 %

    @property
    def regressed(self) -> bool:
        """Whether some row is worse or newly fails."""
        return any(row.verdict in REGRESSIONS for row in self.rows)

    @property
    def compared(self) -> bool:
        """Whether some episode with a figure met its counterpart."""
        changed = (Verdict.NEW_FAILURE, Verdict.FIXED)
        return any(row.seeds or row.verdict in changed for row in self.rows)

    @property
    def exit_code(self) -> int:
        """0 fine, 1 regression, 2 nothing to compare."""
        return 1 if self.regressed else 0 if self.compared else 2

    def counts(self) -> dict[Verdict, int]:
        """Rows by verdict, the most urgent first."""
        held = [row.verdict for row in self.rows]
        return {verdict: held.count(verdict) for verdict in Verdict if verdict in held}


def compare(
    reference: Iterable[Record],
    new: Iterable[Record],
    limit: float,
    columns: Sequence[Column] = (HEADLINE,),
    incomparable: Mapping[ScenarioKey, str] | None = None,
) -> Comparison:
    """Hold new records against a reference, episode by episode.

    Episodes pair by scenario, controller, rate and seed; a scenario that has only another name
    is known by its hash. The last record of an episode counts.

    Args:
        reference: what is to be equalled.
        new: what came out now.
        limit: the share by which a mean may change, 0.05 for 5 %.
        columns: the figures to compare.
        incomparable: scenarios that were not run again, and why.
    """
    newest = {record.episode: record for record in new}
    by_content = {
        _content(record): record
        for _, record in sorted(newest.items(), key=lambda one: str(one[0]))
    }
    hashes = {_place(record): record.scenario_hash for record in by_content.values()}
    cells: dict[tuple[str, str, float | None, str], _Cell] = {}
    for old in {record.episode: record for record in reference}.values():
        cell = cells.setdefault((*_place(old), old.scenario_hash), _Cell(old))
        cell.pairs[old.seed] = (old, newest.get(old.episode, by_content.get(_content(old))))
    rows: list[Row] = []
    for _, cell in sorted(cells.items(), key=lambda one: str(one[0])):
        known = (incomparable or {}).get((cell.first.scenario, cell.first.scenario_hash))
        if gap := cell.gap(known, hashes.get(_place(cell.first))):
            rows += [Row(*_place(cell.first), column, gap[0], remark=gap[1]) for column in columns]
        else:
            rows += cell.rows(columns, limit)
    return Comparison(tuple(sorted(rows, key=_order)), limit)


def _place(record: Record) -> tuple[str, str, float | None]:
    return record.scenario, record.controller, record.rate


def _content(record: Record) -> tuple[str, str, float | None, int]:
    """What tells episodes apart whatever their scenarios' names are."""
    return record.scenario_hash, record.controller, record.rate, record.seed


def _order(row: Row) -> tuple[int, str, str, float, int]:
    rate = -1.0 if row.rate is None else row.rate
    return (
        *(URGENCY[row.verdict], row.scenario, row.controller, rate),
        COLUMNS.index(row.column),
    )


@dataclass(frozen=True)
class _Cell:
    """One controller on one scenario at one rate: by seed the old record and the new one."""

    first: Record
    pairs: dict[int, tuple[Record, Record | None]] = field(default_factory=dict)

    def gap(self, known: str | None, other_hash: str | None) -> tuple[Verdict, str] | None:
        """Why nothing here can be compared; None where something can.

        Args:
            known: why the scenario was not run again.
            other_hash: of the scenario of that name among the new records.
        """
        if known:
            return Verdict.NOT_COMPARABLE, known
        if any(new for _, new in self.pairs.values()):
            return None
        if other_hash:
            own = self.first.scenario_hash
            return Verdict.NOT_COMPARABLE, f"the scenario is {other_hash[:8]}, was {own[:8]}"
        return Verdict.MISSING, "no new record"

    def rows(self, columns: Sequence[Column], limit: float) -> list[Row]:
        both = [one for pair in self.pairs.values() for one in pair if one]
        junctions = sorted({name for one in both for name in one.junctions}) or [""]
        suffixes = [f" {junction}" if len(junctions) > 1 else "" for junction in junctions]
        return [
            self._row(_Tally.of(self.pairs, junction, column), suffix, column, limit)
            for (junction, suffix), column in product(
                zip(junctions, suffixes, strict=True), columns
            )
        ]

    def _row(self, tally: "_Tally", suffix: str, column: Column, limit: float) -> Row:
        judged = judge(tally.before, tally.after, limit, column) if tally.before else None
        verdict = judged.verdict if judged else Verdict.UNCHANGED
        if tally.broken:
            verdict = Verdict.NEW_FAILURE
        elif tally.fixed and verdict is not Verdict.WORSE:
            verdict = Verdict.FIXED
        return Row(
            scenario=f"{self.first.scenario}{suffix}",
            controller=self.first.controller,
            rate=self.first.rate,
            column=column,
            verdict=verdict,
            seeds=len(tally.before),
            reference=judged.reference if judged else None,
            new=judged.new if judged else None,
            difference=judged.difference if judged else None,
            remark="; ".join((*tally.remarks(), *self._traffic())),
        )

    def _traffic(self) -> Iterator[str]:
        """Says so where network or demand came out otherwise, by another SUMO for one."""
        routes = [(old.routes_hash, new.routes_hash) for old, new in self.pairs.values() if new]
        if any(None not in pair and pair[0] != pair[1] for pair in routes):
            yield "its traffic differs from the reference's"


@dataclass
class _Tally:
    """A figure of the seeds of a cell."""

    before: list[float] = field(default_factory=list)
    after: list[float] = field(default_factory=list)
    broken: list[str] = field(default_factory=list)  # why, of seeds that had the figure
    fixed: int = 0
    missing: int = 0

    @classmethod
    def of(
        cls, pairs: Mapping[int, tuple[Record, Record | None]], junction: str, column: Column
    ) -> "_Tally":
        tally = cls()
        for seed, (old, new) in sorted(pairs.items()):
            was = _figure(old, junction, column)
            if new is None:
                tally.missing += 1
            elif (now := _figure(new, junction, column)) is not None and was is not None:
                tally.before.append(was)
                tally.after.append(now)
            elif was is not None:
                tally.broken.append(f"seed {seed} {_why(new)}")
            elif now is not None:
                tally.fixed += 1
        return tally

    def remarks(self) -> Iterator[str]:
        if self.broken:
            more = f" (and {len(self.broken) - 1} more)" if len(self.broken) > 1 else ""
            yield f"{self.broken[0]}{more}"
        if self.fixed:
            yield f"seeds that failed before: {self.fixed}"
        if self.missing:
            yield f"seeds without a new record: {self.missing}"
        if not (self.before or self.broken or self.fixed):
            yield "no figure before and now"


def _figure(record: Record, junction: str, column: Column) -> float | None:
    if record.status != "ok" or record.trips is None or junction not in record.junctions:
        return None
    return column.get(record.junctions[junction], record.trips)


def _why(record: Record) -> str:
    """Why an episode lacks a figure."""
    if record.status == "ok":
        return "has no such vehicle any more"
    return f"{record.status}: {record.reason}" if record.reason else record.status


@dataclass(frozen=True)
class Judged:
    """The verdict on paired values, and what it rests on."""

    verdict: Verdict
    reference: float
    new: float
    difference: Estimate


def judge(reference: Sequence[float], new: Sequence[float], limit: float, column: Column) -> Judged:
    """The verdict on a figure whose values are paired by seed.

    A change counts when the greater mean exceeds the smaller one by more than the limit and by as
    much as the leaderboard shows, a unit of the figure's last digit: from 0 s to 0.01 s of waiting
    has no finite ratio, and is nothing. It is proven when the bootstrap interval of the mean
    difference excludes zero, for which it takes ``benchmark.records.statistics.ENOUGH`` seeds.

    Args:
        reference: values by seed; at least one.
        new: values of the same seeds.
        limit: the share by which a mean may change.
        column: the figure.
    """
    old, now = float(np.mean(reference)), float(np.mean(new))
    (difference,) = estimates([[b - a for a, b in zip(reference, new, strict=True)]])
    smaller, greater = sorted((old, now))
    past = greater - smaller >= 10.0**-column.digits and (
        smaller <= 0 or greater / smaller > 1 + limit
    )
    if not past:
        verdict = Verdict.UNCHANGED
    elif not difference.excludes_zero:
        verdict = Verdict.UNPROVEN
    else:
        verdict = Verdict.BETTER if (now > old) == column.more_is_better else Verdict.WORSE
    return Judged(verdict, old, now, difference)

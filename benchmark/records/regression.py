"""Reference records against new ones -> a verdict per scenario, controller, rate and figure.

Pure: records in, rows out. What stands in docs/regression.md is decided here.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from benchmark.records.measures import HEADLINE, MEASURES, Measure
from benchmark.records.record import Record
from benchmark.records.samples import newest, records_in
from benchmark.records.statistics import Estimate, estimates
from benchmark.records.table import NETWORK, records_table


class Verdict(StrEnum):
    """What became of a finding; the most urgent first."""

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
class Finding:
    """One figure of one controller on one scenario at one rate; means are over paired seeds."""

    scenario: str  # with the junction, where the scenario has several
    controller: str
    rate: float | None
    measure: Measure
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
class RegressionCheck:
    """All findings, the most urgent first."""

    findings: tuple[Finding, ...]
    limit: float  # as a share: 0.05 for 5 %

    @property
    def regressed(self) -> bool:
        """Whether some finding is worse or newly fails."""
        return any(finding.verdict in REGRESSIONS for finding in self.findings)

    @property
    def compared(self) -> bool:
        """Whether some episode with a figure met its counterpart."""
        changed = (Verdict.NEW_FAILURE, Verdict.FIXED)
        return any(finding.seeds or finding.verdict in changed for finding in self.findings)

    @property
    def exit_code(self) -> int:
        """0 fine, 1 regression, 2 nothing to compare."""
        return 1 if self.regressed else 0 if self.compared else 2

    def counts(self) -> dict[Verdict, int]:
        """Findings by verdict, the most urgent first."""
        counts = Counter(finding.verdict for finding in self.findings)
        return {verdict: counts[verdict] for verdict in Verdict if verdict in counts}


def compare(
    reference: Iterable[Record],
    new: Iterable[Record],
    limit: float,
    measures: Sequence[Measure] = (HEADLINE,),
    incomparable: Mapping[ScenarioKey, str] | None = None,
) -> RegressionCheck:
    """Hold new records against a reference, episode by episode.

    Episodes pair by scenario, controller, rate and seed; a scenario that has only another name
    is known by its hash. The last record of an episode counts.

    Args:
        reference: what is to be equalled.
        new: what came out now.
        limit: the share by which a mean may change, 0.05 for 5 %.
        measures: the figures to compare.
        incomparable: scenarios that were not run again, and why.
    """
    by_episode = {record.episode: record for record in _newest(new)}
    by_content = {
        _content(record): record
        for _, record in sorted(by_episode.items(), key=lambda item: str(item[0]))
    }
    hashes = {_place(record): record.scenario_hash for record in by_content.values()}
    pairings: dict[tuple[str, str, float | None, str], _Pairing] = {}
    for old in _newest(reference):
        pairing = pairings.setdefault((*_place(old), old.scenario_hash), _Pairing(old))
        counterpart = by_episode.get(old.episode, by_content.get(_content(old)))
        pairing.pairs[old.seed] = (old, counterpart)
    findings: list[Finding] = []
    for _, pairing in sorted(pairings.items(), key=lambda item: str(item[0])):
        first = pairing.first
        known = (incomparable or {}).get((first.scenario, first.scenario_hash))
        if gap := pairing.gap(known, hashes.get(_place(first))):
            verdict, remark = gap
            findings += [
                Finding(*_place(first), measure, verdict, remark=remark) for measure in measures
            ]
        else:
            findings += pairing.findings(measures, limit)
    return RegressionCheck(tuple(sorted(findings, key=_order)), limit)


def _newest(records: Iterable[Record]) -> list[Record]:
    """The newest record of each episode; an edited controller is held against its older self."""
    every = list(records)
    return records_in(newest(records_table(every)), every)


def _place(record: Record) -> tuple[str, str, float | None]:
    return record.scenario, record.controller, record.rate


def _content(record: Record) -> tuple[str, str, float | None, int]:
    """What tells episodes apart whatever their scenarios' names are."""
    return record.scenario_hash, record.controller, record.rate, record.seed


def _order(finding: Finding) -> tuple[int, str, str, float, int]:
    rate = -1.0 if finding.rate is None else finding.rate
    place = MEASURES.index(finding.measure)
    return URGENCY[finding.verdict], finding.scenario, finding.controller, rate, place


@dataclass(frozen=True)
class _Pairing:
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

    def findings(self, measures: Sequence[Measure], limit: float) -> Iterator[Finding]:
        """Of each junction, and where there are several, figures of whole trips once."""
        both = [record for pair in self.pairs.values() for record in pair if record]
        junctions = sorted({name for record in both for name in record.junctions}) or [NETWORK]
        several = len(junctions) > 1
        for junction in [*junctions, NETWORK] if several else junctions:
            suffix = f" {junction or 'network'}" if several else ""
            for measure in measures:
                if not several or measure.is_of_trips == (junction == NETWORK):
                    tally = _Tally.of(self.pairs, junction, measure)
                    yield self._finding(tally, suffix, measure, limit)

    def _finding(self, tally: "_Tally", suffix: str, measure: Measure, limit: float) -> Finding:
        judged = judge(tally.before, tally.after, limit, measure) if tally.before else None
        verdict = judged.verdict if judged else Verdict.UNCHANGED
        if tally.broken:
            verdict = Verdict.NEW_FAILURE
        elif tally.fixed and verdict is not Verdict.WORSE:
            verdict = Verdict.FIXED
        return Finding(
            scenario=f"{self.first.scenario}{suffix}",
            controller=self.first.controller,
            rate=self.first.rate,
            measure=measure,
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
        cls, pairs: Mapping[int, tuple[Record, Record | None]], junction: str, measure: Measure
    ) -> "_Tally":
        tally = cls()
        for seed, (old, new) in sorted(pairs.items()):
            was = _figure(old, junction, measure)
            if new is None:
                tally.missing += 1
            elif (now := _figure(new, junction, measure)) is not None and was is not None:
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


def _figure(record: Record, junction: str, measure: Measure) -> float | None:
    if record.status != "ok" or record.trips is None:
        return None
    if junction != NETWORK and junction not in record.junctions:
        return None
    return measure.value(record.junctions.get(junction), record.trips)


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


def judge(
    reference: Sequence[float], new: Sequence[float], limit: float, measure: Measure
) -> Judged:
    """The verdict on a figure whose values are paired by seed.

    A change counts when the greater mean exceeds the smaller one by more than the limit and by as
    much as the leaderboard shows, a unit of the figure's last digit: from 0 s to 0.01 s of waiting
    has no finite ratio, and is nothing. It is proven when the bootstrap interval of the mean
    difference excludes zero, for which it takes ``benchmark.records.statistics.ENOUGH`` seeds.

    Args:
        reference: values by seed; at least one.
        new: values of the same seeds.
        limit: the share by which a mean may change.
        measure: the figure.
    """
    old, now = float(np.mean(reference)), float(np.mean(new))
    (difference,) = estimates([[b - a for a, b in zip(reference, new, strict=True)]])
    smaller, greater = sorted((old, now))
    past = greater - smaller >= 10.0**-measure.digits and (
        smaller <= 0 or greater / smaller > 1 + limit
    )
    if not past:
        verdict = Verdict.UNCHANGED
    elif not difference.excludes_zero:
        verdict = Verdict.UNPROVEN
    else:
        verdict = Verdict.BETTER if (now > old) == measure.more_is_better else Verdict.WORSE
    return Judged(verdict, old, now, difference)

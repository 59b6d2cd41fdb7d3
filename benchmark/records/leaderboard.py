"""Records -> rows: means over seeds with intervals, differences to the signal, and marks."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from benchmark.records import samples as cells
from benchmark.records import table as frame
from benchmark.records.measures import HEADLINE
from benchmark.records.record import Record
from benchmark.records.samples import Cell, Floats, Group, Sample
from benchmark.records.statistics import Estimate, estimates
from benchmark.records.table import FIGURES

if TYPE_CHECKING:
    import polars

REFERENCE = "traffic-light"

Status = Literal["ok", "flagged", "failed", "skipped"]
"""What to make of a row: flagged ones have figures and a reason to doubt them, the last two none.
"""


@dataclass(frozen=True)
class Row:
    """One controller on one scenario at one rate."""

    scenario: str  # with the junction, where the scenario has several
    scenario_hash: str
    rate: float | None  # None: no rate was run, only controllers that command no vehicle
    controller: str
    rules: str  # "lights", or the arbitration
    figures: dict[str, Estimate]
    difference: Estimate | None  # headline minus the reference's, paired by seed
    marks: tuple[str, ...] = ()
    other: dict[str, int] = field(default_factory=dict)  # episodes that are not ok, by status
    status: Status = "ok"
    reasons: tuple[
        str, ...
    ] = ()  # why it is not ok: marks, training seeds, what became of episodes

    @property
    def headline(self) -> Estimate | None:
        """Average waiting time [s]."""
        return self.figures.get(HEADLINE.key)


Values = dict[int, float]  # seed -> value
Samples = dict[str, Values]  # column -> values


def rows(records: Iterable[Record]) -> list[Row]:
    """The leaderboard: by scenario and rate, least waiting first.

    The newest record of an episode counts. A controller that commands no vehicle stands at every
    rate. Rows without a single episode that is ok stand last; nothing is left out.
    """
    return of(frame.of(records))


def of(table: "polars.DataFrame") -> list[Row]:
    """The same, from a table that ``benchmark.records.table`` made."""
    every = cells.of(table)
    figures = _figures(one.sample for one in every)
    references = {one.place: one for one in every if one.sample.group.controller == REFERENCE}
    paired = [_paired(one, references.get(one.place)) for one in every]
    differences = iter(estimates(values for values in paired if len(values)))
    found = []
    for one, values in zip(every, paired, strict=True):
        beside = references.get(one.place)
        found.append(
            _row(
                one,
                figures[one.sample],
                next(differences) if len(values) else None,
                figures[beside.sample] if beside else {},
            )
        )
    return sorted(found, key=_order)


def samples(records: Iterable[Record]) -> dict[tuple[str, float | None, str], Samples]:
    """The values by seed behind each row, by its scenario, rate and controller."""
    found = {}
    for one in cells.of(frame.of(records)):
        by_column = {}
        for index, key in enumerate(FIGURES):
            seeds, values = one.sample.values(index)
            by_column[key] = dict(zip(seeds.tolist(), values.tolist(), strict=True))
        found[one.scenario, one.rate, one.sample.group.controller] = by_column
    return found


def _figures(every: Iterable[Sample]) -> dict[Sample, dict[str, Estimate]]:
    """The estimates of each column that has values."""
    keys, values = [], []
    for one in dict.fromkeys(every):
        for index, key in enumerate(FIGURES):
            _, known = one.values(index)
            if len(known):
                keys.append((one, key))
                values.append(known)
    found: dict[Sample, dict[str, Estimate]] = defaultdict(dict)
    for (one, key), estimate in zip(keys, estimates(values), strict=True):
        found[one][key] = estimate
    return found


def _order(row: Row) -> tuple[str, str, float, float, str]:
    waiting = row.headline.mean if row.headline else float("inf")
    return (row.scenario, row.scenario_hash, row.rate or 0.0, waiting, row.controller)


def _paired(one: Cell, reference: Cell | None) -> Floats:
    """Headline minus the reference's on the seeds that both have."""
    if reference is None or one.sample.group.controller == REFERENCE:
        return np.empty(0)
    index = FIGURES.index(HEADLINE.key)
    (own_seeds, own), (other_seeds, other) = (
        each.sample.values(index) for each in (one, reference)
    )
    _, mine, theirs = np.intersect1d(
        own_seeds, other_seeds, assume_unique=True, return_indices=True
    )
    difference: Floats = own[mine] - other[theirs]
    return difference


def _row(
    one: Cell,
    figures: dict[str, Estimate],
    difference: Estimate | None,
    reference: dict[str, Estimate],
) -> Row:
    group = one.sample.group
    found = marks(figures, reference)
    reasons = (*found, *_training(group), *_mishaps(group))
    return Row(
        *(one.scenario, group.scenario_hash, one.rate, group.controller, group.rules),
        *(figures, difference),
        marks=found,
        other=dict(group.other),
        status=_status(group.other, group.count, reasons),
        reasons=reasons,
    )


def _status(other: Counter[str], episodes: int, reasons: Sequence[str]) -> Status:
    if other["skipped"] == episodes:
        return "skipped"
    if other.total() == episodes:
        return "failed"
    return "flagged" if reasons else "ok"


def _training(group: Group) -> Iterator[str]:
    """Why figures may be too good: the controller says it was trained on these very episodes."""
    if met := group.trained():
        span = f"seed {met[0]}" if len(met) == 1 else f"{len(met)} seeds from {met[0]} to {met[-1]}"
        yield f"trained on {span} of its evaluation"


def _mishaps(group: Group) -> Iterator[str]:
    """How many episodes are not ok in which way, and the most frequent reason."""
    reasons: dict[str, Counter[str]] = {}
    for status, reason in group.mishaps():
        reasons.setdefault(status, Counter())[reason] += 1
    for status, found in reasons.items():
        yield f"{found.total()} {status} ({' '.join(found.most_common(1)[0][0].split())})"


MARKS = {
    "creeps": "time loss is over 10 % above the signal's, although waiting is below it",
    "keeps out": "vehicles wait to enter the network, longer than under the signal by over 5 s",
    "blocks": "throughput is over 10 % below the signal's",
    "crashes": "more collisions than under the signal",
}
"""Why a waiting time below the signal's may be low for the wrong reason."""


def marks(figures: dict[str, Estimate], reference: dict[str, Estimate]) -> tuple[str, ...]:
    """The marks that a row deserves, by comparing means with the signal's row.

    Args:
        figures: the row's.
        reference: those of the signal's row; empty where there is none.
    """

    def pair(key: str) -> tuple[float, float]:
        if key not in figures or key not in reference:
            return 0.0, 0.0
        return figures[key].mean, reference[key].mean

    waiting, signal_waiting = pair("average_waiting_time")
    if waiting >= signal_waiting:
        return ()
    loss, signal_loss = pair("time_loss")
    delay, signal_delay = pair("insertion_delay")
    flow, signal_flow = pair("throughput")
    crashes, signal_crashes = pair("collisions")
    found = {
        "creeps": loss > 1.1 * signal_loss,
        "keeps out": delay > signal_delay + 5,
        "blocks": flow < 0.9 * signal_flow,
        "crashes": crashes > signal_crashes,
    }
    return tuple(mark for mark, applies in found.items() if applies)

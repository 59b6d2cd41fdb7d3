"""Records -> rows: means over seeds with intervals, differences to the signal, and marks."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from benchmark.records.flags import flags, marks
from benchmark.records.measures import HEADLINE, MEASURES
from benchmark.records.record import Record
from benchmark.records.samples import Cell, Floats, Group, Sample, cells_of
from benchmark.records.statistics import Estimate, estimates, hourly_probability
from benchmark.records.table import NETWORK, records_table

if TYPE_CHECKING:
    import polars

REFERENCE = "traffic-light"
EXPOSURE = "gridlock_exposure"

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
    rules: str  # "lights", "stop signs", or the arbitration
    figures: dict[str, Estimate]
    difference: Estimate | None  # headline minus the reference's, paired by seed
    marks: tuple[str, ...] = ()
    other: dict[str, int] = field(default_factory=dict)  # episodes that are not ok, by status
    status: Status = "ok"
    reasons: tuple[str, ...] = ()
    """Why it is not ok: marks, flags, gridlocks, training, versions, what became of episodes."""

    junction: str | None = None
    """Of several; ``NETWORK`` for the whole network, whose figures are those of whole trips."""

    gridlock: Estimate | None = None
    """The probability of one within an hour; None where records do not say."""

    @property
    def headline(self) -> Estimate | None:
        """Average waiting time [s]."""
        return self.figures.get(HEADLINE.key)

    @property
    def is_of_network(self) -> bool:
        """Whether it is of the network of several junctions, which has no headline."""
        return self.junction == NETWORK


def rows_of_records(records: Iterable[Record]) -> list[Row]:
    """The leaderboard of records, oldest first."""
    return rows_of(records_table(records))


def rows_of(table: "polars.DataFrame") -> list[Row]:
    """The leaderboard of a table: by scenario and rate, least waiting first.

    The newest record of an episode counts. A controller that commands no vehicle stands at every
    rate. Rows without a single episode that is ok stand last; nothing is left out.
    """
    cells = cells_of(table)
    figures = _figures(cell.sample for cell in cells)
    references = {cell.place: cell for cell in cells if cell.sample.group.controller == REFERENCE}
    pairs = [(cell, references.get(cell.place)) for cell in cells]
    paired = [_difference(cell, reference) for cell, reference in pairs]
    differences = iter(estimates(values for values in paired if len(values)))
    rows = [
        _row(cell, figures, next(differences) if len(values) else None, deserved)
        for cell, values, deserved in zip(cells, paired, marks(pairs), strict=True)
    ]
    return sorted(rows, key=_order)


Figures = dict[str, Estimate]


def _figures(samples: Iterable[Sample]) -> dict[Sample, Figures]:
    """The estimates of each measure that has values."""
    keys, values = [], []
    for sample in dict.fromkeys(samples):
        for measure in MEASURES:
            _, known = sample.values(measure.key)
            if len(known):
                keys.append((sample, measure.key))
                values.append(known)
    figures: dict[Sample, Figures] = defaultdict(dict)
    for (sample, key), estimate in zip(keys, estimates(values), strict=True):
        figures[sample][key] = estimate
    return figures


def _order(row: Row) -> tuple[str, str, float, float, str]:
    waiting = row.headline.mean if row.headline else float("inf")
    return (row.scenario, row.scenario_hash, row.rate or 0.0, waiting, row.controller)


def _difference(cell: Cell, reference: Cell | None) -> Floats:
    """Headline minus the reference's on the seeds that both have."""
    if reference is None or cell.sample.group.controller == REFERENCE:
        return np.empty(0)
    own, beside = cell.sample.paired(reference.sample, HEADLINE.key)
    difference: Floats = own - beside
    return difference


def _row(
    cell: Cell,
    figures: dict[Sample, Figures],
    difference: Estimate | None,
    deserved: tuple[str, ...],
) -> Row:
    group = cell.sample.group
    gridlock = _gridlock(cell.sample)
    reasons = (
        *deserved,
        *flags(_with_network(cell, figures)),
        *_gridlocks(cell.sample),
        *_training(group),
        *_versions(group),
        *_mishaps(group),
    )
    return Row(
        scenario=cell.scenario,
        scenario_hash=group.scenario_hash,
        rate=cell.rate,
        controller=group.controller,
        rules=group.rules,
        figures=figures[cell.sample],
        difference=difference,
        marks=deserved,
        other=dict(group.other),
        status=_status(group.other, group.count, reasons),
        reasons=reasons,
        junction=cell.sample.junction if cell.network else None,
        gridlock=gridlock,
    )


def _gridlock(sample: Sample) -> Estimate | None:
    """The probability of a gridlock within an hour, from the episodes that say whether."""
    (locked, _), (_, exposures) = sample.values("first_gridlock"), sample.values(EXPOSURE)
    return hourly_probability(len(locked), exposures) if len(exposures) else None


def _gridlocks(sample: Sample) -> Iterator[str]:
    """In how many episodes it gridlocked, if in any."""
    (locked, times), (_, exposures) = sample.values("first_gridlock"), sample.values(EXPOSURE)
    if len(locked):
        episodes = f"{len(locked)} of {len(exposures)} episodes"
        yield f"gridlocks in {episodes}, the earliest at {min(times):.0f} s"


def _with_network(cell: Cell, figures: dict[Sample, Figures]) -> Figures:
    """The figures of a cell and those of its whole network."""
    own = figures[cell.sample]
    return own if cell.network is None else figures[cell.network] | own


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


def _versions(group: Group) -> Iterator[str]:
    """That different software made the episodes, so that their mean is of no one thing."""
    if len(group.versions) > 1:
        yield f"records of {' and '.join(group.versions)} in one mean"


def _mishaps(group: Group) -> Iterator[str]:
    """How many episodes are not ok in which way, and the most frequent reason."""
    reasons: dict[str, Counter[str]] = {}
    for status, reason in group.mishaps():
        reasons.setdefault(status, Counter())[reason] += 1
    for status, counted in reasons.items():
        ((reason, _),) = counted.most_common(1)
        yield f"{counted.total()} {status} ({' '.join(reason.split())})"

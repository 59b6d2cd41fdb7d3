"""Records -> rows: means over seeds with intervals, differences to the signal, and marks."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

from benchmark.record import JunctionMetrics, Record, TripMetrics, told_apart
from benchmark.statistics import Estimate, estimates

REFERENCE = "traffic-light"

Status = Literal["ok", "flagged", "failed", "skipped"]
"""What to make of a row: flagged ones have figures and a reason to doubt them, the last two none.
"""

Getter = Callable[[JunctionMetrics, TripMetrics], float | None]


@dataclass(frozen=True, slots=True)
class Column:
    """A figure of the leaderboard."""

    key: str
    title: str
    unit: str
    digits: int
    get: Getter
    brief: bool = True  # whether it is in the tables for people, not only in CSV and JSON
    more_is_better: bool = False


COLUMNS = (
    Column("average_waiting_time", "waiting", "s", 1, lambda j, t: j.average_waiting_time),
    Column("wang_waiting_time", "waiting (Wang)", "s", 1, lambda j, t: j.wang_waiting_time),
    Column(
        *("waiting_time_per_vehicle", "waiting per vehicle", "s", 1),
        lambda j, t: j.waiting_time_per_vehicle.mean if j.waiting_time_per_vehicle else None,
        brief=False,
    ),
    Column(
        *("waiting_time_p95", "waiting p95", "s", 1),
        lambda j, t: j.waiting_time_per_vehicle.p95 if j.waiting_time_per_vehicle else None,
        brief=False,
    ),
    Column(
        *("waiting_time_maximum", "waiting maximum", "s", 1),
        lambda j, t: j.waiting_time_per_vehicle.maximum if j.waiting_time_per_vehicle else None,
        brief=False,
    ),
    Column("time_loss", "time loss", "s", 1, lambda j, t: t.time_loss),
    Column("travel_time", "travel time", "s", 1, lambda j, t: t.travel_time),
    Column("insertion_delay", "insertion delay", "s", 1, lambda j, t: t.insertion_delay),
    Column("never_inserted", "never inserted", "veh", 1, lambda j, t: t.never_inserted, False),
    Column(
        *("throughput", "throughput", "veh/h", 0, lambda j, t: j.throughput),
        more_is_better=True,
    ),
    Column("collisions", "collisions", "pairs", 1, lambda j, t: t.collisions),
    Column("collisions_with_robot", "with an RV", "pairs", 1, lambda j, t: t.collisions_with_robot),
    Column(
        *("emergency_brakings", "emergency brakings", "", 1),
        lambda j, t: t.emergency_brakings,
        brief=False,
    ),
    Column(
        *("unregulated_lane_ratio", "unregulated lanes", "share", 2),
        lambda j, t: j.unregulated_lane_ratio,
    ),
    Column("lane_changes", "lane changes", "", 0, lambda j, t: j.lane_changes, False),
    Column("go_held_back", "Go held back", "", 0, lambda j, t: j.go_held_back, False),
    Column("refused_commands", "refused commands", "", 0, lambda j, t: j.refused_commands, False),
    Column("co2", "CO2", "g/km", 0, lambda j, t: t.co2, False),
    Column("nox", "NOx", "mg/km", 0, lambda j, t: t.nox, False),
    Column("fuel", "fuel", "g/km", 1, lambda j, t: t.fuel, False),
)
HEADLINE = COLUMNS[0]


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


@dataclass
class _Cell:
    """The records of one row."""

    key: tuple[str, str, float | None, str]
    records: list[Record]
    junction: str
    samples: Samples = field(default_factory=dict)

    def __post_init__(self) -> None:
        # by seed, as resampling depends on the order, and records lie as their episodes ended
        self.records = sorted(self.records, key=lambda record: record.seed)
        for column in COLUMNS:
            values = {
                record.seed: float(value)
                for record in self.records
                if record.status == "ok"
                and record.trips is not None
                and self.junction in record.junctions
                and (value := column.get(record.junctions[self.junction], record.trips)) is not None
            }
            self.samples[column.key] = values


def rows(records: Iterable[Record]) -> list[Row]:
    """The leaderboard: by scenario and rate, least waiting first.

    The newest record of an episode counts. A controller that commands no vehicle stands at every
    rate. Rows without a single episode that is ok stand last; nothing is left out.
    """
    newest = {record.episode: record for record in told_apart(records)}
    cells = _cells(list(newest.values()))
    samples = [
        list(values.values()) for cell in cells for values in cell.samples.values() if values
    ]
    found = iter(estimates(samples))
    figures = [{k: next(found) for k, values in c.samples.items() if values} for c in cells]
    references = {cell.key[:3]: i for i, cell in enumerate(cells) if cell.key[3] == REFERENCE}
    paired = [_paired(cell, cells, references) for cell in cells]
    differences = iter(estimates([values for values in paired if values]))
    table = []
    for cell, figure, values in zip(cells, figures, paired, strict=True):
        reference = references.get(cell.key[:3])
        table.append(
            _row(
                cell,
                figure,
                next(differences) if values else None,
                figures[reference] if reference is not None else {},
            )
        )
    return sorted(table, key=_order)


def samples(records: Iterable[Record]) -> dict[tuple[str, float | None, str], Samples]:
    """The values by seed behind each row, by its scenario, rate and controller."""
    newest = {record.episode: record for record in told_apart(records)}
    found = {}
    for cell in _cells(list(newest.values())):
        scenario, _, rate, controller = cell.key
        found[scenario, rate, controller] = cell.samples
    return found


def _order(row: Row) -> tuple[str, str, float, float, str]:
    waiting = row.headline.mean if row.headline else float("inf")
    return (row.scenario, row.scenario_hash, row.rate or 0.0, waiting, row.controller)


def _cells(records: Sequence[Record]) -> list[_Cell]:
    """Records by scenario, rate and controller; those without a rate at every rate of theirs."""
    rates: dict[tuple[str, str], set[float]] = {}
    for record in records:
        known = rates.setdefault((record.scenario, record.scenario_hash), set())
        if record.rate is not None:
            known.add(record.rate)
    groups: dict[tuple[str, str, float | None, str], list[Record]] = {}
    for record in records:
        own = rates[record.scenario, record.scenario_hash]
        every: list[float | None] = [*sorted(own)] or [None]
        for rate in every if record.rate is None else [record.rate]:
            key = (record.scenario, record.scenario_hash, rate, record.controller)
            groups.setdefault(key, []).append(record)
    versions = Counter(scenario for scenario, _ in rates)
    places: dict[tuple[str, str], set[str]] = {}
    for record in records:
        places.setdefault((record.scenario, record.scenario_hash), set()).update(record.junctions)
    cells = []
    for (scenario, scenario_hash, rate, controller), members in groups.items():
        shown = scenario if versions[scenario] == 1 else f"{scenario} ({scenario_hash[:8]})"
        junctions = sorted(places[scenario, scenario_hash])
        for junction in junctions or [""]:
            name = shown if len(junctions) < 2 else f"{shown} {junction}"
            cells.append(_Cell((name, scenario_hash, rate, controller), members, junction))
    return cells


def _paired(
    cell: _Cell, cells: Sequence[_Cell], references: dict[tuple[str, str, float | None], int]
) -> list[float]:
    """Headline minus the reference's on the seeds that both have."""
    reference = references.get(cell.key[:3])
    if reference is None or cell.key[3] == REFERENCE:
        return []
    other = cells[reference].samples[HEADLINE.key]
    own = cell.samples[HEADLINE.key]
    return [own[seed] - other[seed] for seed in sorted(own.keys() & other.keys())]


def _row(
    cell: _Cell,
    figures: dict[str, Estimate],
    difference: Estimate | None,
    reference: dict[str, Estimate],
) -> Row:
    scenario, scenario_hash, rate, controller = cell.key
    some = next((one for one in cell.records if one.rules), cell.records[-1])
    rules = "lights" if some.rules == "signals" else some.arbitration or "?"
    found = marks(figures, reference)
    other = Counter[str](one.status for one in cell.records if one.status != "ok")
    reasons = (*found, *_training(cell.records), *_mishaps(cell.records))
    return Row(
        *(scenario, scenario_hash, rate, controller, rules, figures, difference),
        marks=found,
        other=dict(other),
        status=_status(other, len(cell.records), reasons),
        reasons=reasons,
    )


def _status(other: Counter[str], episodes: int, reasons: Sequence[str]) -> Status:
    if other["skipped"] == episodes:
        return "skipped"
    if other.total() == episodes:
        return "failed"
    return "flagged" if reasons else "ok"


def _training(records: Sequence[Record]) -> Iterator[str]:
    """Why figures may be too good: the controller says it was trained on these very episodes."""
    met = sorted(
        one.seed
        for one in records
        if any(training.meets(one.scenario, one.seed) for training in one.trained_on or ())
    )
    if met:
        span = f"seed {met[0]}" if len(met) == 1 else f"{len(met)} seeds from {met[0]} to {met[-1]}"
        yield f"trained on {span} of its evaluation"


def _mishaps(records: Sequence[Record]) -> Iterator[str]:
    """How many episodes are not ok in which way, and the most frequent reason."""
    reasons: dict[str, Counter[str]] = {}
    for one in records:
        if one.status != "ok":
            reasons.setdefault(one.status, Counter())[one.reason or "no reason given"] += 1
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

"""What the methods page states: formulas, and the versions and hashes behind the figures."""

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from markupsafe import Markup

from benchmark.records.formulas import FORMULAS
from benchmark.records.measures import COLUMNS, Column
from benchmark.records.record import Record


@dataclass(frozen=True)
class Metric:
    """A column with its definition."""

    column: Column
    formula: Markup
    words: str


@dataclass(frozen=True)
class Origin:
    """Where a controller's records come from."""

    controller: str
    sources: tuple[str, ...]  # distributions and versions, or files with their hashes
    weights: tuple[str, ...]  # SHA-256
    rules: tuple[str, ...]
    trained_on: tuple[str, ...]


@dataclass(frozen=True)
class Ground:
    """What a scenario's records were made on, as SHA-256."""

    scenario: str
    hash: str
    networks: tuple[str, ...]
    routes: int  # different ones, by seed and rate
    episodes: int


def mathml(latex: str) -> Markup:
    """A formula for browsers and screen readers."""
    from latex2mathml.converter import convert

    return Markup(convert(latex))  # noqa: S704 - the formulas are ours


def metrics() -> list[Metric]:
    """All columns of the leaderboard."""
    found = []
    for column in COLUMNS:
        formula = FORMULAS[column.key]
        found.append(Metric(column, mathml(formula.latex), formula.words))
    return found


def versions(records: Iterable[Record]) -> list[tuple[tuple[str, str, str], int]]:
    """Right of Way, SUMO and Python, and how many episodes each combination ran."""
    counted = Counter(
        (one.versions.rightofway, one.versions.sumo, one.versions.python) for one in records
    )
    return sorted(counted.items())


def records_hash(records: Iterable[Record]) -> str:
    """SHA-256 of what the records say but for wall times, whatever their order."""
    lines = sorted(one.model_copy(update={"wall_time": 0.0}).line() for one in records)
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def origins(records: Iterable[Record]) -> dict[str, Origin]:
    """Where each controller comes from, by name."""
    groups: dict[str, list[Record]] = {}
    for record in records:
        groups.setdefault(record.controller, []).append(record)
    return {
        name: Origin(
            name,
            _distinct(one.controller_from for one in members),
            _distinct(one.weights_hash for one in members),
            _distinct(_rules(one) for one in members),
            _distinct(words for one in members for words in _training(one)),
        )
        for name, members in sorted(groups.items())
    }


def _rules(record: Record) -> str | None:
    if record.rules == "robot vehicles":
        return f"robot vehicles, {record.arbitration} arbitration"
    return record.rules


def _training(record: Record) -> Iterator[str]:
    for one in record.trained_on or ():
        yield f"{', '.join(one.scenarios)}, seeds {one.first} to {one.last}"


def _distinct(values: Iterable[str | None]) -> tuple[str, ...]:
    return tuple(sorted({value for value in values if value}))


def grounds(records: Iterable[Record]) -> list[Ground]:
    """What each scenario's records were made on."""
    groups: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        groups.setdefault((record.scenario, record.scenario_hash), []).append(record)
    return [
        Ground(
            scenario,
            scenario_hash,
            _distinct(one.network_hash for one in members),
            len(_distinct(one.routes_hash for one in members)),
            len(members),
        )
        for (scenario, scenario_hash), members in sorted(groups.items())
    ]

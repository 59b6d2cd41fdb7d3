"""What the methods page states: formulas, and the versions and hashes behind the figures."""

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from markupsafe import Markup

from benchmark.records.record import Record


@dataclass(frozen=True)
class Origin:
    """Where a controller's records come from."""

    controller: str
    sources: tuple[str, ...]  # distributions and versions, or files with their hashes
    weights: tuple[str, ...]  # SHA-256
    rules: tuple[str, ...]
    trained_on: tuple[str, ...]


@dataclass(frozen=True)
class Conditions:
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


def counted_versions(records: Iterable[Record]) -> list[tuple[tuple[str, str, str], int]]:
    """Right of Way, SUMO and Python, and how many episodes each combination ran."""
    counted = Counter(
        (made.rightofway, made.sumo, made.python)
        for made in (record.versions for record in records)
    )
    return sorted(counted.items())


def hash_of_records(records: Iterable[Record]) -> str:
    """SHA-256 of what the records say but for wall times, whatever their order."""
    lines = sorted(record.model_copy(update={"wall_time": 0.0}).line() for record in records)
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def origins_of(records: Iterable[Record]) -> dict[str, Origin]:
    """Where each controller comes from, by name."""
    groups: dict[str, list[Record]] = {}
    for record in records:
        groups.setdefault(record.controller, []).append(record)
    return {
        name: Origin(
            name,
            _distinct(record.controller_from for record in members),
            _distinct(record.weights_hash for record in members),
            _distinct(_rules(record) for record in members),
            _distinct(words for record in members for words in _training(record)),
        )
        for name, members in sorted(groups.items())
    }


def _rules(record: Record) -> str | None:
    if record.rules == "robot vehicles":
        return f"robot vehicles, {record.arbitration} arbitration"
    return record.rules


def _training(record: Record) -> Iterator[str]:
    for traffic in record.trained_on or ():
        yield f"{', '.join(traffic.scenarios)}, seeds {traffic.first} to {traffic.last}"


def _distinct(values: Iterable[str | None]) -> tuple[str, ...]:
    return tuple(sorted({value for value in values if value}))


def conditions_of(records: Iterable[Record]) -> list[Conditions]:
    """What each scenario's records were made on."""
    groups: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        groups.setdefault((record.scenario, record.scenario_hash), []).append(record)
    return [
        Conditions(
            scenario,
            scenario_hash,
            _distinct(record.network_hash for record in members),
            len(_distinct(record.routes_hash for record in members)),
            len(members),
        )
        for (scenario, scenario_hash), members in sorted(groups.items())
    ]

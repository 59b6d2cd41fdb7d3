"""Records -> the figures of each controller, intersection and rate, by seed."""

from collections.abc import Container, Iterable, Iterator, Mapping
from typing import TypeAlias

from baselines.paper.published import FOLDER, INTERSECTIONS
from benchmark.records.measures import COLUMNS
from benchmark.records.record import JunctionMetrics, Record
from benchmark.records.statistics import Estimate, estimates

Seeds: TypeAlias = Mapping[int, Record]

GETTERS = {column.key: column.get for column in COLUMNS}


def canonical(reference: str) -> str:
    """A controller's reference as records have it: options sorted by name."""
    name, mark, query = reference.partition("?")
    return name + mark + "&".join(sorted(query.split("&")))


class Samples:
    """The newest record of each episode at the paper's intersections.

    Where records of several versions of a scenario lie side by side, those of the last one count.

    Args:
        records: of any scenarios, oldest first.
    """

    def __init__(self, records: Iterable[Record]) -> None:
        names = {f"{FOLDER}/{one}": one for one in INTERSECTIONS}
        chosen = [record for record in records if record.scenario in names]
        versions = {record.scenario: record.scenario_hash for record in chosen}
        self._cells: dict[tuple[str, str, float | None], dict[int, Record]] = {}
        for record in chosen:
            if record.scenario_hash == versions[record.scenario]:
                key = (record.controller, names[record.scenario], record.rate)
                self._cells.setdefault(key, {})[record.seed] = record

    @property
    def controllers(self) -> list[str]:
        """All that have records, sorted."""
        return sorted({controller for controller, _, _ in self._cells})

    def records(self, controllers: Container[str]) -> Iterator[Record]:
        """All records of some controllers."""
        for (controller, _, _), seeds in self._cells.items():
            if controller in controllers:
                yield from seeds.values()

    def all(self, controller: str, intersection: str, rate: float) -> Seeds:
        """Records by seed, also those that are not ok; without a rate they stand at every rate."""
        key = (controller, intersection)
        return self._cells.get((*key, rate)) or self._cells.get((*key, None)) or {}

    def ok(self, controller: str, intersection: str, rate: float) -> Seeds:
        """Records by seed, in the order of seeds, of episodes that ran to their end."""
        found = self.all(controller, intersection, rate)
        return {seed: found[seed] for seed in sorted(found) if found[seed].status == "ok"}

    def values(self, key: str, controller: str, intersection: str, rate: float) -> dict[int, float]:
        """A column of the leaderboard by seed, where the episode has it."""
        found = self.ok(controller, intersection, rate)
        get = GETTERS[key]
        return {
            seed: float(value)
            for seed, record in found.items()
            if record.trips and (value := get(junction_of(record), record.trips)) is not None
        }

    def estimate(
        self, key: str, controller: str, intersection: str, rate: float
    ) -> Estimate | None:
        """The mean over seeds with its interval; None without records."""
        values = self.values(key, controller, intersection, rate)
        return estimates([list(values.values())])[0] if values else None

    def paired(
        self, key: str, pair: tuple[str, str], intersection: str, rate: float
    ) -> tuple[list[float], list[float]]:
        """A column of two controllers on the seeds that both have."""
        one, other = (self.values(key, name, intersection, rate) for name in pair)
        seeds = [seed for seed in one if seed in other]
        return [one[seed] for seed in seeds], [other[seed] for seed in seeds]


def junction_of(record: Record) -> JunctionMetrics:
    """The figures of the only intersection of a record that is ok."""
    (junction,) = record.junctions.values()
    return junction

"""What the pages show, worked out once from records."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from statistics import fmean

from benchmark.records.leaderboard import REFERENCE, Row, rows_of
from benchmark.records.record import Record
from benchmark.records.samples import Sample, cells_of, newest, records_in, told_apart
from benchmark.records.table import records_table
from benchmark.reports.site.addresses import Addresses
from benchmark.reports.site.replays import ReplayPage
from benchmark.scenario.scenario import Scenario

MOST_PAIRS = 300  # pages of pairs; with more controllers only the best ones are all compared

Place = tuple[str, float | None]
"""A scenario, as the leaderboard names it, and a rate."""


def is_variant(controller: str) -> bool:
    """Whether a controller's name holds options."""
    return "?" in controller


def rates(rows: Iterable[Row]) -> list[float | None]:
    """The rates of rows, rising; first the lack of one."""
    return sorted({row.rate for row in rows}, key=lambda rate: -1.0 if rate is None else rate)


@dataclass(frozen=True)
class Contents:
    """The figures behind all pages."""

    records: list[Record]  # the newest of each episode
    rows: list[Row]
    samples: Mapping[tuple[str, float | None, str], Sample]  # by scenario, rate and controller
    files: Mapping[str, Scenario]  # the scenarios at hand, by hash
    drawings: Mapping[str, Mapping[str, str]]  # SVG by panel, by the scenario's hash
    replays: Sequence[ReplayPage] = ()

    @classmethod
    def of(
        cls,
        records: Iterable[Record],
        files: Mapping[str, Scenario] | None = None,
        drawings: Mapping[str, Mapping[str, str]] | None = None,
        replays: Sequence[ReplayPage] = (),
    ) -> "Contents":
        """Work out what records say; what is given besides only adds to it."""
        every = list(records)
        table = records_table(every)
        return cls(
            records=records_in(newest(told_apart(table)), every),
            rows=rows_of(table),
            samples={
                (cell.scenario, cell.rate, cell.sample.group.controller): cell.sample
                for cell in cells_of(table)
            },
            files=files or {},
            drawings=drawings or {},
            replays=replays,
        )

    @cached_property
    def scenarios(self) -> dict[str, list[Row]]:
        """The rows of each scenario."""
        by_scenario: dict[str, list[Row]] = {}
        for row in self.rows:
            by_scenario.setdefault(row.scenario, []).append(row)
        return by_scenario

    @cached_property
    def places(self) -> dict[Place, dict[str, Row]]:
        """The rows of each scenario and rate, by controller, least waiting first."""
        by_place: dict[Place, dict[str, Row]] = {}
        for row in self.rows:
            by_place.setdefault((row.scenario, row.rate), {})[row.controller] = row
        return by_place

    @cached_property
    def controllers(self) -> list[str]:
        """All controllers, by how many of the others they wait less than; variants behind.

        Of each other it is the share of the scenarios and rates in which both have figures, so
        that who was run in the easy ones only does not come first for that.
        """
        names = {row.controller for row in self.rows}
        less: dict[str, Counter[str]] = {name: Counter() for name in names}
        common: dict[str, Counter[str]] = {name: Counter() for name in names}
        for rows in self.places.values():
            ranked = [name for name, row in rows.items() if row.headline]
            for first, second in combinations(ranked, 2):
                less[first][second] += 1
                common[first][second] += 1
                common[second][first] += 1

        def share(name: str) -> float:
            met = common[name]
            return fmean(less[name][other] / met[other] for other in met) if met else 0.0

        return sorted(names, key=lambda name: (is_variant(name), -share(name), name))

    @cached_property
    def variants(self) -> list[str]:
        """The controllers with options, where there are some without."""
        variants = [name for name in self.controllers if is_variant(name)]
        return variants if len(variants) < len(self.controllers) else []

    @cached_property
    def rates(self) -> list[float | None]:
        """All rates, rising; first the lack of one."""
        return rates(self.rows)

    @cached_property
    def addresses(self) -> Addresses:
        """Where each page lies."""
        return Addresses.of(self.scenarios, self.controllers)

    @cached_property
    def pairs(self) -> list[tuple[str, str]]:
        """The pairs of controllers that have a page: all, or those that matter most."""
        count = len(self.controllers)
        while count * (count - 1) / 2 > MOST_PAIRS:
            count -= 1
        chosen = list(combinations(self.controllers[:count], 2))
        if REFERENCE in self.controllers:
            others = [name for name in self.controllers if name != REFERENCE]
            known = {frozenset(pair) for pair in chosen}
            chosen += [(name, REFERENCE) for name in others if {name, REFERENCE} not in known]
        return chosen

    def reference(self, row: Row) -> Row | None:
        """The signal's row beside a row."""
        return self.places[row.scenario, row.rate].get(REFERENCE)

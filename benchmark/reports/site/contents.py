"""What the pages show, worked out once from records."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from statistics import fmean

from benchmark.records import leaderboard
from benchmark.records.leaderboard import REFERENCE, Row, Values
from benchmark.records.record import Record, told_apart
from benchmark.reports.site.addresses import Addresses
from benchmark.reports.site.replays import Replay
from benchmark.scenario.scenario import Scenario

MOST_PAIRS = 300  # pages of pairs; with more controllers only the best ones are all compared

Cell = tuple[str, float | None]
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
    samples: Mapping[tuple[str, float | None, str], Mapping[str, Values]]
    files: Mapping[str, Scenario]  # the scenarios at hand, by hash
    drawings: Mapping[str, Mapping[str, str]]  # SVG by panel, by the scenario's hash
    replays: Sequence[Replay] = ()

    @classmethod
    def of(
        cls,
        records: Iterable[Record],
        files: Mapping[str, Scenario] | None = None,
        drawings: Mapping[str, Mapping[str, str]] | None = None,
        replays: Sequence[Replay] = (),
    ) -> "Contents":
        """Work out what records say; what is given besides only adds to it."""
        newest = list({record.episode: record for record in told_apart(records)}.values())
        return cls(
            records=newest,
            rows=leaderboard.rows(newest),
            samples=leaderboard.samples(newest),
            files=files or {},
            drawings=drawings or {},
            replays=replays,
        )

    @cached_property
    def scenarios(self) -> dict[str, list[Row]]:
        """The rows of each scenario."""
        found: dict[str, list[Row]] = {}
        for row in self.rows:
            found.setdefault(row.scenario, []).append(row)
        return found

    @cached_property
    def cells(self) -> dict[Cell, dict[str, Row]]:
        """The rows of each scenario and rate, by controller, least waiting first."""
        found: dict[Cell, dict[str, Row]] = {}
        for row in self.rows:
            found.setdefault((row.scenario, row.rate), {})[row.controller] = row
        return found

    @cached_property
    def controllers(self) -> list[str]:
        """All controllers, by how many of the others they wait less than; variants behind.

        Of each other it is the share of the scenarios and rates in which both have figures, so
        that who was run in the easy ones only does not come first for that.
        """
        names = {row.controller for row in self.rows}
        less: dict[str, Counter[str]] = {name: Counter() for name in names}
        common: dict[str, Counter[str]] = {name: Counter() for name in names}
        for rows in self.cells.values():
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
        found = [name for name in self.controllers if is_variant(name)]
        return found if len(found) < len(self.controllers) else []

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
            chosen += [(one, REFERENCE) for one in others if {one, REFERENCE} not in known]
        return chosen

    def reference(self, row: Row) -> Row | None:
        """The signal's row beside a row."""
        return self.cells[row.scenario, row.rate].get(REFERENCE)

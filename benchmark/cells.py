"""From a table of records to cells: what each row of a leaderboard is made of.

A cell is one controller on one junction at one rate. The newest record of an episode counts, and
what commands no vehicle stands at every rate.
"""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from benchmark.frame import FIGURES
from benchmark.record import Training

if TYPE_CHECKING:
    import polars

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
NAMES = ("scenario", "scenario_hash", "controller")
EPISODE = (*NAMES, "rate", "seed")
ELSE = ("status", "reason", "rules", "arbitration", "trained_on", "junction")


@dataclass(frozen=True)
class Group:
    """The episodes of one controller on one scenario at one rate, by seed."""

    scenario: str
    scenario_hash: str
    controller: str
    rate: float | None
    table: "polars.DataFrame"  # of all groups
    start: int  # its rows there: the first,
    stop: int  # and the one after the last

    @cached_property
    def rules(self) -> str:
        """What rules: lights, or the arbitration."""
        part = self._part("rules", "arbitration")
        known = part.filter(part["rules"].is_not_null())
        rules, arbitration = known.row(0) if len(known) else part.row(-1)
        return "lights" if rules == "signals" else arbitration or "?"

    @cached_property
    def episodes(self) -> "polars.DataFrame":
        """A row for each episode: seed, status, reason, trained_on."""
        part = self._part("record", "seed", "status", "reason", "trained_on")
        return part.filter(part["record"].is_first_distinct())

    @cached_property
    def other(self) -> Counter[str]:
        """Episodes that are not ok, by status."""
        return Counter(one for one in self.episodes["status"] if one != "ok")

    def mishaps(self) -> Iterator[tuple[str, str]]:
        """Status and reason of each episode that is not ok."""
        if self.other:
            for status, reason in self.episodes.select("status", "reason").iter_rows():
                if status != "ok":
                    yield status, reason or "no reason given"

    def trained(self) -> list[int]:
        """The seeds of episodes that the controller was trained on."""
        known = self.episodes.filter(self.episodes["trained_on"].is_not_null())
        read: dict[str, list[Training]] = {}
        for text in known["trained_on"].unique():
            parts = json.loads(text)
            read[text] = [Training(scenarios=s, first=a, last=b) for s, a, b in parts]
        return [
            seed
            for seed, text in known.select("seed", "trained_on").iter_rows()
            if any(one.meets(self.scenario, seed) for one in read[text])
        ]

    def _part(self, *names: str) -> "polars.DataFrame":
        return self.table[self.start : self.stop].select(names)


@dataclass(frozen=True, eq=False)
class Sample:
    """The figures of a group at one junction."""

    group: Group
    seeds: Ints  # of the episodes that are ok, sorted
    figures: Floats  # a row for each of them, a column for each of FIGURES; NaN where it has none

    def values(self, index: int) -> tuple[Ints, Floats]:
        """The seeds that have a figure, and its values."""
        column = self.figures[:, index]
        known = ~np.isnan(column)
        return (self.seeds, column) if known.all() else (self.seeds[known], column[known])


@dataclass(frozen=True)
class Cell:
    """What a row of the leaderboard is made of."""

    scenario: str  # with the junction, where the scenario has several
    rate: float | None
    sample: Sample  # the same at every rate where no vehicle is commanded

    @property
    def place(self) -> tuple[str, str, float | None]:
        """Where it competes."""
        return self.scenario, self.sample.group.scenario_hash, self.rate


def of(table: "polars.DataFrame") -> list[Cell]:
    """The cells of a table that ``benchmark.frame`` made, in no order."""
    table = _newest(_told_apart(table))
    figures = table.select(FIGURES).to_numpy()
    seeds, good = table["seed"].to_numpy(), (table["status"] == "ok").to_numpy()
    junctions = table["junction"].to_numpy()
    places = _places(table)
    versions = Counter(scenario for scenario, _ in places)
    cells = []
    for group in _groups(table):
        rates, names = places[group.scenario, group.scenario_hash]
        shown = group.scenario
        if versions[shown] > 1:
            shown = f"{shown} ({group.scenario_hash[:8]})"
        rows = np.arange(group.start, group.stop)
        for name in names or [""]:
            here = rows[good[rows] & (junctions[rows] == name)]
            sample = Sample(group, seeds[here], figures[here])
            place = shown if len(names) < 2 else f"{shown} {name}"
            every = (rates or [None]) if group.rate is None else [group.rate]
            cells += [Cell(place, rate, sample) for rate in every]
    return cells


def _told_apart(table: "polars.DataFrame") -> "polars.DataFrame":
    """A controller's name stands for one file: its hash is added where needed.

    As ``benchmark.record.told_apart``.
    """
    import polars

    file = polars.col("controller_from").str.extract(r"(?s) sha256:(.+)$", 1)
    table = table.with_columns(file=file)
    if table["file"].null_count() == len(table):
        return table
    several = polars.col("file").drop_nulls().n_unique().over("controller") > 1
    name = polars.format("{} ({})", "controller", polars.col("file").str.slice(0, 8))
    return table.with_columns(
        polars.when(polars.col("file").is_not_null() & several)
        .then(name)
        .otherwise("controller")
        .alias("controller")
    )


def _newest(table: "polars.DataFrame") -> "polars.DataFrame":
    """The newest record of each episode, those of a group together and by seed."""
    import polars

    # as numbers, names are compared many times faster
    codes = [polars.col(name).rank("dense").alias(f"{name} code") for name in NAMES]
    keys = [*(f"{name} code" for name in NAMES), "rate", "seed"]
    table = table.select("record", *EPISODE, *ELSE, *FIGURES).with_columns(codes)
    newest = polars.col("record") == polars.col("record").max().over(keys)
    return table.filter(newest).sort(*keys, "record", nulls_last=False)


def _groups(table: "polars.DataFrame") -> Iterator[Group]:
    """The groups of a sorted table."""
    import polars

    if not len(table):
        return
    keys = [*(f"{name} code" for name in NAMES), "rate"]
    begins = table.select(
        polars.any_horizontal(
            polars.col(key).ne_missing(polars.col(key).shift()) for key in keys
        ).alias("begins")
    )["begins"].to_numpy()
    starts = [0, *(np.flatnonzero(begins[1:]) + 1).tolist()]
    heads = table[starts].select(*NAMES, "rate").iter_rows(named=True)
    for head, start, stop in zip(heads, starts, [*starts[1:], len(table)], strict=True):
        yield Group(**head, table=table, start=start, stop=stop)


def _places(
    table: "polars.DataFrame",
) -> dict[tuple[str, str], tuple[list[float | None], list[str]]]:
    """The rates and the junctions of each scenario, by its name and hash."""
    import polars

    rates, junctions = (
        polars.col(name).drop_nulls().unique().sort() for name in ("rate", "junction")
    )
    found = table.group_by("scenario", "scenario_hash").agg(rates, junctions)
    return {(name, code): (known, there) for name, code, known, there in found.iter_rows()}

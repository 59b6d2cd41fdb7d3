"""From a table of records to cells: what each row of a leaderboard is made of.

A cell is one controller on one junction at one rate. The newest record of an episode counts, and
what commands no vehicle stands at every rate.
"""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from benchmark.control.training import Training
from benchmark.records.table import FIGURES

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
    rules: str  # what rules: lights, or the arbitration
    count: int  # of its episodes
    others: bool  # whether some are not ok
    trains: bool  # whether it says what it was trained on
    start: int  # its rows in the table
    length: int
    table: "polars.DataFrame"  # of all groups

    @cached_property
    def other(self) -> Counter[str]:
        """Episodes that are not ok, by status."""
        return Counter(status for status, _ in self.mishaps())

    def mishaps(self) -> Iterator[tuple[str, str]]:
        """Status and reason of each episode that is not ok."""
        if self.others:
            for status, reason in self._episodes("status", "reason"):
                if status != "ok":
                    yield status, reason or "no reason given"

    def trained(self) -> list[int]:
        """The seeds of episodes that the controller was trained on."""
        if not self.trains:
            return []
        return [
            seed
            for seed, text in self._episodes("seed", "trained_on")
            if any(one.meets(self.scenario, seed) for one in _training(text))
        ]

    def _episodes(self, *names: str) -> Iterator[tuple[Any, ...]]:
        """Columns of each episode; those of several junctions have several rows."""
        part = self.table.slice(self.start, self.length).select("record", *names)
        return part.filter(part["record"].is_first_distinct()).select(names).iter_rows()


@cache
def _training(text: str | None) -> tuple[Training, ...]:
    parts = json.loads(text or "[]")
    return tuple(Training(scenarios=names, first=a, last=b) for names, a, b in parts)


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
    """The cells of a table that ``benchmark.records.table`` made, in no order."""
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
        rows = np.arange(group.start, group.start + group.length)
        for name in names or [""]:
            here = rows[good[rows] & (junctions[rows] == name)]
            sample = Sample(group, seeds[here], figures[here])
            place = shown if len(names) < 2 else f"{shown} {name}"
            every = (rates or [None]) if group.rate is None else [group.rate]
            cells += [Cell(place, rate, sample) for rate in every]
    return cells


def _told_apart(table: "polars.DataFrame") -> "polars.DataFrame":
    """A controller's name stands for one code: its hash is added where needed.

    As ``benchmark.records.record.told_apart``.
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
    from polars import col, first, when

    says = col("rules").is_not_null()
    known = col("arbitration").filter(says).first()
    arbitration = when(says.any()).then(known).otherwise(col("arbitration").last())
    heads = (
        table.with_row_index("start")
        .group_by(*(f"{name} code" for name in NAMES), "rate", maintain_order=True)
        .agg(
            *(first(name) for name in NAMES),
            when(col("rules").filter(says).first() == "signals")
            .then(polars.lit("lights"))
            .otherwise(arbitration.fill_null("?"))
            .alias("rules"),
            col("record").n_unique().alias("count"),
            (col("status") != "ok").any().alias("others"),
            col("trained_on").is_not_null().any().alias("trains"),
            first("start"),
            polars.len().alias("length"),
        )
        .select(field.name for field in fields(Group) if field.name != "table")
    )
    for head in heads.iter_rows(named=True):
        yield Group(**head, table=table)


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

"""From a table of records to samples and cells: what tables, plots and the site are made of.

What counts is decided here, for all of them: the newest record of an episode; a controller's name
stands for one code; what commands no vehicle stands at every rate. A sample is one controller on
one junction at one rate, or on a whole network of several.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from benchmark.records.measures import BY_KEY
from benchmark.records.record import Record
from benchmark.records.table import FIGURES, NETWORK

if TYPE_CHECKING:
    import polars

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
BySeed = dict[int, float]

NAMES = ("scenario", "scenario_hash", "controller")
EPISODE = (*NAMES, "rate", "seed")
ELSE = ("status", "reason", "rules", "arbitration", "is_trained_on", "junction", "versions")
COLUMN = {key: index for index, key in enumerate(FIGURES)}
CODES = tuple(f"{name} code" for name in NAMES)


def newest(table: "polars.DataFrame", *besides: str) -> "polars.DataFrame":
    """The rows of the newest record of each episode.

    Args:
        table: that ``benchmark.records.table`` made.
        besides: further columns that tell episodes apart.
    """
    import polars

    # as numbers, names are compared many times faster
    codes = [polars.col(name).rank("dense").alias(f"{name} code") for name in NAMES]
    newest_record = polars.col("record").max().over(*CODES, "rate", "seed", *besides)
    return table.with_columns(codes).filter(polars.col("record") == newest_record)


def told_apart(table: "polars.DataFrame") -> "polars.DataFrame":
    """A table in which a controller's name stands for one code: its hash is added where needed.

    The same code as it was before an edit, and another of the same name, are controllers of their
    own beside it.
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


def records_in(table: "polars.DataFrame", records: Sequence[Record]) -> list[Record]:
    """The records that a table has, under the names that it gives their controllers.

    Args:
        table: of ``records``, or of some of them.
        records: all of which the first table was made.
    """
    names = table.select("record", "controller").unique().sort("record").iter_rows()
    return [
        records[number].model_copy(update={"controller": controller})
        for number, controller in names
    ]


def joined(table: "polars.DataFrame") -> "polars.DataFrame":
    """A table in which a scenario has one name: that of the newest record with its content.

    Files of the same content in two folders are one scenario. At a demand of its own, as in
    ``334@700``, a scenario keeps the name that says so.
    """
    import polars

    named = table.select("scenario", "scenario_hash").unique()
    named = named.filter(~polars.col("scenario").str.contains("@", literal=True))
    if named["scenario_hash"].is_unique().all():
        return table
    newest_name = polars.col("scenario").sort_by("record").last().over("scenario_hash")
    several = polars.col("scenario_hash").is_in(
        named.filter(named["scenario_hash"].is_duplicated())["scenario_hash"].unique().to_list()
    ) & ~polars.col("scenario").str.contains("@", literal=True)
    plain = table.filter(several).with_columns(scenario=newest_name)
    return polars.concat([table.filter(~several), plain]).sort("record", maintain_order=True)


@dataclass(frozen=True)
class Group:
    """The episodes of one controller on one scenario at one rate, by seed."""

    scenario: str
    scenario_hash: str
    controller: str
    rate: float | None
    rules: str  # what rules: lights, stop signs, or the arbitration
    count: int  # of its episodes
    others: bool  # whether some are not ok
    trains: bool  # whether the controller was trained on some
    versions: list[str]  # of the software that made them
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
        return [seed for seed, is_met in self._episodes("seed", "is_trained_on") if is_met]

    def _episodes(self, *names: str) -> Iterator[tuple[Any, ...]]:
        """Columns of each episode; those of several junctions have several rows."""
        part = self.table.slice(self.start, self.length).select("record", *names)
        return part.filter(part["record"].is_first_distinct()).select(names).iter_rows()


@dataclass(frozen=True, eq=False)
class Sample:
    """The figures of a group at one junction, or on the network of several."""

    group: Group
    junction: str
    seeds: Ints  # of the episodes that are ok, sorted
    records: Ints  # their numbers in the table
    figures: Floats  # a row for each of them, a column for each of FIGURES; NaN where it has none

    def values(self, key: str) -> tuple[Ints, Floats]:
        """The seeds that have a figure, and its values."""
        column = self.figures[:, COLUMN[key]]
        known = ~np.isnan(column)
        return (self.seeds, column) if known.all() else (self.seeds[known], column[known])

    def by_seed(self, key: str) -> BySeed:
        """A figure by seed."""
        seeds, values = self.values(key)
        return dict(zip(seeds.tolist(), values.tolist(), strict=True))

    def paired(self, other: "Sample", key: str) -> tuple[Floats, Floats]:
        """A figure of both on the seeds that both have."""
        (seeds, values), (other_seeds, other_values) = self.values(key), other.values(key)
        _, mine, theirs = np.intersect1d(
            seeds, other_seeds, assume_unique=True, return_indices=True
        )
        return values[mine], other_values[theirs]


@dataclass(frozen=True)
class Cell:
    """What a row of the leaderboard is made of."""

    scenario: str  # with the junction, where the scenario has several
    rate: float | None
    sample: Sample  # the same at every rate where no vehicle is commanded
    network: Sample | None  # of the whole network, where the scenario has several junctions

    def source(self, key: str) -> Sample:
        """The sample that has a figure: those of whole trips are the network's."""
        return self.network if self.network and BY_KEY[key].is_of_trips else self.sample

    @property
    def place(self) -> tuple[str, str, float | None]:
        """Where it competes."""
        return self.scenario, self.sample.group.scenario_hash, self.rate


def cells_of(table: "polars.DataFrame") -> list[Cell]:
    """The cells of a table that ``benchmark.records.table`` made, in no order."""
    table = newest(told_apart(joined(table))).select("record", *CODES, *EPISODE, *ELSE, *FIGURES)
    table = table.sort(*CODES, "rate", "seed", "record", nulls_last=False)
    figures = table.select(FIGURES).to_numpy()
    seeds, good = table["seed"].to_numpy(), (table["status"] == "ok").to_numpy()
    records, junctions = table["record"].to_numpy(), table["junction"].to_numpy()
    places = _places(table)
    versions = Counter(scenario for scenario, _ in places)
    cells = []
    for group in _groups(table):
        rates, names = places[group.scenario, group.scenario_hash]
        shown = group.scenario
        if versions[shown] > 1:
            shown = f"{shown} ({group.scenario_hash[:8]})"
        rows = np.arange(group.start, group.start + group.length)
        samples = {}
        for name in names:
            here = rows[good[rows] & (junctions[rows] == name)]
            samples[name] = Sample(group, name, seeds[here], records[here], figures[here])
        network = samples[NETWORK] if len(samples) > 1 else None
        for name, sample in samples.items():
            place = f"{shown} {name or 'network'}" if network else shown
            every = (rates or [None]) if group.rate is None else [group.rate]
            cells += [Cell(place, rate, sample, network) for rate in every]
    return cells


def _groups(table: "polars.DataFrame") -> Iterator[Group]:
    """The groups of a sorted table."""
    import polars
    from polars import col, first, when

    says = col("rules").is_not_null()
    known = col("arbitration").filter(says).first()
    arbitration = when(says.any()).then(known).otherwise(col("arbitration").last())
    heads = (
        table.with_row_index("start")
        .group_by(*CODES, "rate", maintain_order=True)
        .agg(
            *(first(name) for name in NAMES),
            when(col("rules").filter(says).first() == "signals")
            .then(polars.lit("lights"))
            .when(col("rules").filter(says).first() == "stop signs")
            .then(polars.lit("stop signs"))
            .otherwise(arbitration.fill_null("?"))
            .alias("rules"),
            col("record").n_unique().alias("count"),
            (col("status") != "ok").any().alias("others"),
            col("is_trained_on").any().alias("trains"),
            col("versions").drop_nulls().unique().sort().alias("versions"),
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
    """The rates and the junctions of each scenario, by its name and hash.

    Behind several junctions stands their network. Where no episode has figures, nothing tells the
    junctions, and one without a name stands for them.
    """
    import polars

    rates = polars.col("rate").drop_nulls().unique().sort()
    junctions = polars.col("junction").drop_nulls().unique()
    known = table.group_by("scenario", "scenario_hash").agg(rates, junctions)
    return {
        (scenario, scenario_hash): (
            ran,
            sorted(names, key=lambda name: (name == NETWORK, name)) or [""],
        )
        for scenario, scenario_hash, ran, names in known.iter_rows()
    }

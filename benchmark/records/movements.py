"""Waiting by movement: who pays for a short mean."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from benchmark.records.record import Record
from benchmark.records.samples import Cell, cells_of
from benchmark.records.statistics import Estimate, estimates

if TYPE_CHECKING:
    import polars


@dataclass(frozen=True)
class MovementRow:
    """One controller at one junction and rate."""

    scenario: str
    rate: float | None
    controller: str
    waiting: dict[str, Estimate]  # by movement [s]: the mean over seeds of its vehicles' mean


def movement_rows(table: "polars.DataFrame", records: Sequence[Record]) -> list[MovementRow]:
    """The rows of a results folder, by scenario, rate and controller.

    Args:
        table: of the records.
        records: as long as the table counts, oldest first.
    """
    cells = [cell for cell in cells_of(table) if cell.sample is not cell.network]
    rows = [
        MovementRow(
            cell.scenario,
            cell.rate,
            cell.sample.group.controller,
            dict(_waiting(cell, records)),
        )
        for cell in cells
        if len(cell.sample.records)
    ]
    return sorted(rows, key=lambda row: (row.scenario, row.rate or 0.0, row.controller))


def _waiting(cell: Cell, records: Sequence[Record]) -> Iterator[tuple[str, Estimate]]:
    means: dict[str, list[float]] = {}
    for number in cell.sample.records:
        junction = records[number].junctions[cell.sample.junction]
        for movement, waiting in junction.waiting_by_movement.items():
            means.setdefault(movement, []).append(waiting.mean)
    yield from zip(means, estimates(means.values()), strict=True)

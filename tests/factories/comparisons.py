"""A reference, and records that compare with it as a test wants."""

from pathlib import Path
from typing import Any

from benchmark.records import reference
from benchmark.records.measures import MEASURES, Measure
from benchmark.records.provenance import Git, Provenance
from benchmark.records.record import Record
from benchmark.records.regression import RegressionCheck, compare

KEYS = {measure.key: measure for measure in MEASURES}
WAITING, THROUGHPUT = KEYS["average_waiting_time"], KEYS["throughput"]
BASE = (20.0, 22.0, 18.0, 25.0, 19.0, 21.0, 23.0, 20.5)  # s, by seed
LIMIT = 0.05


def scaled(factor: float) -> list[float]:
    return [factor * wait for wait in BASE]


def compared(
    old: list[Record], new: list[Record], *columns: Measure, **more: Any
) -> RegressionCheck:
    return compare(old, new, LIMIT, columns or (WAITING,), **more)


MADE = Provenance(
    made="2026-01-02 03:04:05",
    command="rightofway reference update",
    suite="regression",
    suite_hash="a",
    episodes=8,
    records_hash="b",
    platform="Linux x86_64",
    versions={"rightofway": "1.0", "sumo": "1.28.0"},
    git=Git(commit="f" * 40, dirty=True),
)


def written(folder: Path, records: list[Record]) -> Path:
    reference.write_reference(folder, records, MADE)
    return folder

"""The committed results, cell by cell."""

from collections.abc import Callable

from benchmark.records.record import Record
from factories.scenarios import ROOT

RESULTS = ROOT / "results"
RATES = [rate / 10 for rate in range(1, 11)]
FOUR = ("229", "332", "334", "449")
Of = dict[int, Record]
"""Records by seed."""
Figure = Callable[[Record], float | None]


def waiting(record: Record) -> float | None:
    return record.junctions["intersection"].average_waiting_time


def by_seed(records: list[Record], scenario: str, controller: str, rate: float | None) -> Of:
    """A cell's records."""
    return {
        r.seed: r
        for r in records
        if r.scenario.endswith(scenario) and (r.controller, r.rate) == (controller, rate)
    }


def differences(one: Of, other: Of, figure: Figure) -> list[float]:
    """Of a figure, paired by seed."""
    assert one.keys() == other.keys()
    pairs = [(figure(one[seed]), figure(other[seed])) for seed in sorted(one)]
    return [a - b for a, b in pairs if a is not None and b is not None]

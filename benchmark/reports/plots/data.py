"""What the figures are drawn from: cells of the leaderboard, and records of the scenarios shown."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import fmean
from typing import TYPE_CHECKING

import numpy as np

from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.messages import nearest
from benchmark.records.leaderboard import REFERENCE
from benchmark.records.measures import HEADLINE
from benchmark.records.record import JunctionMetrics, Record
from benchmark.records.samples import BySeed, Cell, Floats, cells_of
from benchmark.reports.words import percent

if TYPE_CHECKING:
    import polars

USUAL_RATE = 0.4
MOST_SCENARIOS, MOST_CONTROLLERS = 8, 5  # in one figure, unless more are asked for


@dataclass(frozen=True)
class Wish:
    """What a user wants to see; what is left open is chosen."""

    scenarios: Sequence[str] = ()
    controllers: Sequence[str] = ()
    rates: Sequence[float] = ()
    rate: float | None = None  # of figures at one rate; None: that nearest to USUAL_RATE


class Data:
    """The cells of a results folder, those that are shown, and what belongs to them.

    Args:
        table: of the folder, as ``benchmark.records.table`` makes it.
        records: gives the records of scenarios, for what a table does not hold.
        wish: what is to be shown.

    Raises:
        UsageError: there is nothing of that kind.
    """

    def __init__(
        self,
        table: "polars.DataFrame",
        records: Callable[[Sequence[str]], Iterable[Record]],
        wish: Wish,
    ) -> None:
        cells = [cell for cell in cells_of(table) if cell.sample is not cell.network]
        self._cells: dict[tuple[str, float | None, str], Cell] = {
            (cell.scenario, cell.rate, cell.sample.group.controller): cell for cell in cells
        }
        self._table, self._read = table, records
        known = sorted({cell.scenario for cell in cells})
        self.scenarios = _chosen("scenario", wish.scenarios, known) or known[:MOST_SCENARIOS]
        self.scenarios_left_out = len(known) - len(self.scenarios)
        here = [cell for cell in cells if cell.scenario in self.scenarios]
        run = {cell.rate for cell in here if cell.rate is not None}
        self.rates = sorted(run.intersection(wish.rates) if wish.rates else run)
        if wish.rates and not self.rates:
            wanted, at_hand = (
                ", ".join(map(percent, sorted(rates))) for rates in (wish.rates, run)
            )
            raise UsageError(f"--rate {wanted}: no records; at hand: {at_hand or 'none'}")
        nearest_rate = min(run, key=lambda rate: abs(rate - USUAL_RATE), default=USUAL_RATE)
        self.rate = nearest_rate if wish.rate is None else wish.rate
        groups = [cell.sample.group for cell in here]
        lights = {group.controller for group in groups if group.rules in ("lights", "stop signs")}
        self.signals = sorted(lights, key=lambda name: (name != REFERENCE, name))
        others = sorted({group.controller for group in groups} - lights)
        asked = _chosen("controller", wish.controllers, [*others, *self.signals])
        self.controllers = [name for name in asked if name not in lights] or self._best(others)
        self.controllers_left_out = len({*others}.difference(self.controllers))

    def values(self, key: str, scenario: str, rate: float | None, controller: str) -> BySeed:
        """A measure by seed; empty where there is none."""
        cell = self._cells.get((scenario, rate, controller))
        return cell.sample.by_seed(key) if cell else {}

    def signal(self, key: str, scenario: str, controller: str = REFERENCE) -> BySeed:
        """The same, of what commands no vehicle and so is the same at every rate."""
        for rate in (*self.rates, None):
            if values := self.values(key, scenario, rate, controller):
                return values
        return {}

    def paired(
        self, key: str, scenario: str, rate: float, controller: str
    ) -> tuple[Floats, Floats]:
        """A measure of a controller and of the signal on the seeds that both have."""
        ours, signal = (self._cells.get((scenario, rate, name)) for name in (controller, REFERENCE))
        if ours is None or signal is None:
            return np.empty(0), np.empty(0)
        return ours.sample.paired(signal.sample, key)

    def junctions(self, scenario: str, rate: float, controller: str) -> list[JunctionMetrics]:
        """What records say of a junction, of each episode that is ok, by seed.

        What commands no vehicle is the same at every rate.
        """
        places = (rate, *self.rates, None) if controller in self.signals else (rate,)
        cells = (self._cells.get((scenario, place, controller)) for place in places)
        cell = next(filter(None, cells), None)
        if cell is None:
            return []
        sample = cell.sample
        return [self._records[number].junctions[sample.junction] for number in sample.records]

    @cached_property
    def _records(self) -> dict[int, Record]:
        """The records of the scenarios shown, by their numbers in the table."""
        import polars

        hashes = {
            cell.sample.group.scenario_hash
            for cell in self._cells.values()
            if cell.scenario in self.scenarios
        }
        shown = self._table.filter(polars.col("scenario_hash").is_in(hashes))
        names = shown["scenario"].unique().sort().to_list()  # one content may have several
        rows = self._table.filter(polars.col("scenario").is_in(names))
        return dict(zip(rows["record"].unique().sort(), self._read(names), strict=True))

    def _best(self, names: Sequence[str]) -> list[str]:
        """The controllers that are shown where none are asked for: those that wait least."""

        def waiting(name: str) -> float:
            means = [
                fmean(values.values())
                for scenario in self.scenarios
                for rate in self.rates
                if (values := self.values(HEADLINE.key, scenario, rate, name))
            ]
            return fmean(means) if means else float("inf")

        plain = [name for name in names if "?" not in name] or names
        return sorted(plain, key=lambda name: (waiting(name), name))[:MOST_CONTROLLERS]


def _chosen(kind: str, wanted: Sequence[str], known: Sequence[str]) -> list[str]:
    """What was asked for, each by its name or the last part of it.

    Raises:
        UsageError: nothing has that name.
    """
    chosen: list[str] = []
    for name in dict.fromkeys(wanted):
        meant = [full for full in known if name in (full, full.rpartition("/")[2])]
        if not meant:
            raise UsageError(f'--{kind} "{name}": no records{nearest(name, known)}')
        chosen += meant
    return list(dict.fromkeys(chosen))

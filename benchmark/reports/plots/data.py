"""What the figures are drawn from: cells of the leaderboard, and records of the scenarios shown."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.messages import nearest
from benchmark.records import samples
from benchmark.records.record import Record, told_apart
from benchmark.records.samples import Cell
from benchmark.records.table import FIGURES

if TYPE_CHECKING:
    import polars

MOST_SCENARIOS, MOST_CONTROLLERS = 8, 5  # in one figure, unless more are asked for
USUAL = (
    *("wang", "wang-tuned", "hierarchical", "hierarchical-tuned", "time-windows"),
    *("virtual-signal", "first-come"),
)
REFERENCE = "traffic-light"

Seeds = dict[int, float]  # seed -> value


@dataclass(frozen=True)
class Wish:
    """What a user wants to see; what is left open is chosen."""

    scenarios: Sequence[str] = ()
    controllers: Sequence[str] = ()
    rates: Sequence[float] = ()
    rate: float = 0.4  # of figures at one rate


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
        self._cells: dict[tuple[str, float | None, str], Cell] = {
            (one.scenario, one.rate, one.sample.group.controller): one for one in samples.of(table)
        }
        self._read = records
        self.rate = wish.rate
        known = list(dict.fromkeys(scenario for scenario, _, _ in sorted_keys(self._cells)))
        self.scenarios = _chosen("scenario", wish.scenarios, known) or known[:MOST_SCENARIOS]
        self.scenarios_left_out = len(known) - len(self.scenarios)
        here = {key for key in self._cells if key[0] in self.scenarios}
        run = {rate for _, rate, _ in here if rate is not None}
        self.rates = sorted(run.intersection(wish.rates) if wish.rates else run)
        lights = {key[2] for key in here if self._cells[key].sample.group.rules == "lights"}
        self.signals = sorted(lights, key=lambda name: (name != REFERENCE, name))
        others = sorted({name for _, _, name in here} - lights)
        asked = _chosen("controller", wish.controllers, [*others, *self.signals])
        self.controllers = [name for name in asked if name not in lights] or _usual(others)
        self.controllers_left_out = len({*others}.difference(self.controllers))

    def values(self, key: str, scenario: str, rate: float | None, controller: str) -> Seeds:
        """A column of the leaderboard by seed; empty where there is none."""
        cell = self._cells.get((scenario, rate, controller))
        if cell is None:
            return {}
        seeds, values = cell.sample.values(FIGURES.index(key))
        return dict(zip(seeds.tolist(), values.tolist(), strict=True))

    def signal(self, key: str, scenario: str, controller: str = REFERENCE) -> Seeds:
        """The same, of what commands no vehicle and so is the same at every rate."""
        for rate in (*self.rates, None):
            if found := self.values(key, scenario, rate, controller):
                return found
        return {}

    def records(self, scenario: str, rate: float, controller: str) -> list[Record]:
        """The newest record of each episode that is ok, by seed."""
        return self._by_cell.get((scenario, rate, controller), [])

    @cached_property
    def _by_cell(self) -> dict[tuple[str, float | None, str], list[Record]]:
        wanted = {*self.controllers}
        newest = {
            one.episode: one
            for one in told_apart(self._read(self.scenarios))
            if one.controller in wanted and one.rate == self.rate
        }
        found: dict[tuple[str, float | None, str], list[Record]] = {}
        for one in sorted(newest.values(), key=lambda record: record.seed):
            if one.status == "ok" and len(one.junctions) == 1:
                found.setdefault((one.scenario, one.rate, one.controller), []).append(one)
        return found


def sorted_keys(
    keys: Iterable[tuple[str, float | None, str]],
) -> list[tuple[str, float | None, str]]:
    """Keys of cells in order; without a rate first."""
    return sorted(keys, key=lambda key: (key[0], -1.0 if key[1] is None else key[1], key[2]))


def _chosen(kind: str, wanted: Sequence[str], known: Sequence[str]) -> list[str]:
    """What was asked for, each by its name or the last part of it.

    Raises:
        UsageError: nothing has that name.
    """
    found = []
    for name in dict.fromkeys(wanted):
        meant = [one for one in known if name in (one, one.rpartition("/")[2])]
        if not meant:
            raise UsageError(f'--{kind} "{name}": no records{nearest(name, known)}')
        found += meant
    return list(dict.fromkeys(found))


def _usual(known: Sequence[str]) -> list[str]:
    """The controllers that are shown where none are asked for."""
    plain = [name for name in known if "?" not in name]
    first = [name for name in USUAL if name in plain]
    rest = [name for name in plain if name not in first]
    return [*first, *rest][:MOST_CONTROLLERS] or list(known[:MOST_CONTROLLERS])

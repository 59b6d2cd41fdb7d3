"""Which records the paper's table and figures lack, and the commands that make them."""

import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from baselines.paper.published import FOLDER, INTERSECTIONS, RATES, cells
from baselines.paper.samples import Samples, canonical
from benchmark.reports.tables import percent
from benchmark.study import suite as suite_file
from benchmark.study.suite import Suite

SEEDS = 20  # where the suite names none
SUITE = suite_file.FOLDER / "paper.toml"  # of all that the tables and figures show


@dataclass(frozen=True)
class Gap:
    """Cells of one controller that lack seeds."""

    controller: str
    seeds: int  # that each cell should have
    found: dict[tuple[str, float], int]  # intersection and rate -> seeds that are there
    failed: int  # episodes that were run and are not ok

    @property
    def words(self) -> str:
        """What is missing, for people."""
        failures = f"; episodes that are not ok: {self.failed}" if self.failed else ""
        if not any(self.found.values()) and len(self.found) == len(INTERSECTIONS) * len(RATES):
            return f"no records{failures}"
        places: dict[tuple[str, int], list[str]] = {}
        for (where, rate), count in self.found.items():
            places.setdefault((where, count), []).append(percent(rate))
        words = ", ".join(
            f"{where} at {' and '.join(rates)} ({count} of {self.seeds} seeds)"
            for (where, count), rates in places.items()
        )
        return f"{words}{failures}"

    def command(self, folder: Path) -> str:
        """What makes the missing records."""
        where = [one for one in INTERSECTIONS if any(one == place for place, _ in self.found)]
        rates = [one for one in RATES if any(one == rate for _, rate in self.found)]
        return shlex.join(
            [
                *("rightofway", "run"),
                *([FOLDER] if len(where) == len(INTERSECTIONS) else where),
                *("--controller", self.controller),
                *(part for rate in rates for part in ("--rate", f"{rate:g}")),
                *("--seeds", str(self.seeds), "--out", str(folder)),
            ]
        )


def gaps(samples: Samples, suite: Suite) -> list[Gap]:
    """What of the suite is not there, in the suite's order."""
    return [gap for one in suite.controllers if (gap := _gap(samples, canonical(one), suite)).found]


def _gap(samples: Samples, controller: str, suite: Suite) -> Gap:
    seeds = suite.seeds or SEEDS
    wanted = range(1, seeds + 1)
    counts = {
        cell: sum(seed in samples.ok(controller, *cell) for seed in wanted) for cell in cells()
    }
    found = {cell: count for cell, count in counts.items() if count < seeds}
    failed = sum(
        record.status != "ok"
        for cell in found
        for record in samples.all(controller, *cell).values()
    )
    return Gap(controller, seeds, found, failed)


def lines(found: list[Gap], folder: Path) -> Iterator[str]:
    """A Markdown item for each gap."""
    for gap in found:
        yield f"- `{gap.controller}`: {gap.words}. Make them with"
        yield f"  `{gap.command(folder)}`"

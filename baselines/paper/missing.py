"""Which records the paper's table and figures lack, and the commands that make them."""

import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from baselines.paper.published import FOLDER, INTERSECTIONS, RATES, cells
from baselines.paper.samples import Samples, canonical
from benchmark.reports.words import percent
from benchmark.study.suite import Suite, shipped_suites

SEEDS = 20  # where the suite names none
SUITE = shipped_suites()["paper"]  # of all that the tables and figures show


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
        where = [name for name in INTERSECTIONS if any(name == place for place, _ in self.found)]
        rates = [rate for rate in RATES if any(rate == missing for _, missing in self.found)]
        places = [FOLDER] if len(where) == len(INTERSECTIONS) else where
        options = ["--controller", self.controller]
        options += [part for rate in rates for part in ("--rate", f"{rate:g}")]
        options += ["--seeds", str(self.seeds), "--out", str(folder)]
        return shlex.join(["rightofway", "run", *places, *options])


def gaps(samples: Samples, suite: Suite) -> list[Gap]:
    """What of the suite is not there, in the suite's order."""
    lacking = (_gap(samples, canonical(name), suite) for name in suite.controllers)
    return [gap for gap in lacking if gap.found]


def _gap(samples: Samples, controller: str, suite: Suite) -> Gap:
    seeds = suite.seeds or SEEDS
    wanted = range(1, seeds + 1)
    counts = {
        cell: len({*wanted}.intersection(samples.seeds(controller, cell))) for cell in cells()
    }
    found = {cell: count for cell, count in counts.items() if count < seeds}
    lacking = (samples.sample(controller, cell) for cell in found)
    failed = sum(sample.group.other.total() for sample in lacking if sample)
    return Gap(controller, seeds, found, failed)


def lines(lacking: list[Gap], folder: Path) -> Iterator[str]:
    """A Markdown item for each gap."""
    for gap in lacking:
        yield f"- `{gap.controller}`: {gap.words}. Make them with"
        yield f"  `{gap.command(folder)}`"

"""Intervals as small bars in tables, all on one logarithmic scale."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from markupsafe import Markup

from benchmark.records.leaderboard import Row

WIDTH, HEIGHT = 120, 14  # of a bar's drawing, in its own units
LEAST = 3.0  # width of an interval that is too narrow to see


@dataclass(frozen=True)
class Scale:
    """From seconds to places on a bar, by log(1 + x): zero has a place."""

    lowest: float  # s
    highest: float  # s

    @classmethod
    def of(cls, rows: Iterable[Row]) -> "Scale":
        """The scale that holds the intervals of all rows' waiting times."""
        ends = [
            value
            for row in rows
            if row.headline
            for value in (row.headline.mean, *row.headline.bounds)
        ]
        return cls(min(ends, default=0.0), max(ends, default=1.0))

    def place(self, seconds: float) -> float:
        """Where a value stands, from 0 to the bar's width."""
        low, high = math.log1p(self.lowest), math.log1p(self.highest)
        share = (math.log1p(seconds) - low) / (high - low) if high > low else 0.5
        return 4 + (WIDTH - 8) * min(max(share, 0.0), 1.0)

    def bar(self, row: Row, reference: Row | None) -> Markup:
        """A row's mean and interval, and a mark where the signal stands; hidden from readers.

        Whoever does not see it has the numbers in the same cell.
        """
        if row.headline is None:
            return Markup("")
        estimate = row.headline
        start, end = map(self.place, estimate.bounds)
        centre, length = (start + end) / 2, max(end - start, LEAST)
        mark = ""
        if reference and reference.headline:
            x = self.place(reference.headline.mean)
            mark = f'<path class="signal" d="M{x:.1f} 0V{HEIGHT}"/>'
        return Markup(  # noqa: S704 - numbers only
            f'<svg class="interval" viewBox="0 0 {WIDTH} {HEIGHT}" aria-hidden="true">'
            f'<path class="rail" d="M0 7H{WIDTH}"/>{mark}'
            f'<rect x="{centre - length / 2:.1f}" y="4" width="{length:.1f}" height="6" rx="3"/>'
            f'<circle cx="{self.place(estimate.mean):.1f}" cy="7" r="2.6"/></svg>'
        )

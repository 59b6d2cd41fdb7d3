"""Turning counts by period."""

from collections.abc import Sequence
from typing import Any, Self

from pydantic import Field, model_validator

from benchmark.plumbing.models import Table
from benchmark.scenario.layout import COMPASS
from benchmark.scenario.units import PositiveTime, Time

LARGEST_COUNT = 10_000  # veh/h
ANALYSIS_PERIOD = 900.0  # s, over which the Highway Capacity Manual averages flow rates


class TurnCounts(Table):
    """Vehicles per hour from one approach by turn."""

    left: float = Field(0.0, ge=0, le=LARGEST_COUNT, description="[veh/h]")
    cross: float = Field(0.0, ge=0, le=LARGEST_COUNT, description="[veh/h]")
    right: float = Field(0.0, ge=0, le=LARGEST_COUNT, description="[veh/h]")
    u_turn: float = Field(0.0, ge=0, le=LARGEST_COUNT, description="[veh/h]")

    def of(self, turn: str) -> float:
        """The count of a turn [veh/h]."""
        return {"L": self.left, "C": self.cross, "R": self.right, "U": self.u_turn}[turn]

    def scaled(self, factor: float) -> Self:
        """Every count multiplied."""
        if factor == 1:
            return self
        return self.model_copy(update={turn: count * factor for turn, count in self})

    @property
    def total(self) -> float:
        """All turns together [veh/h]."""
        return self.left + self.cross + self.right + self.u_turn


class Demand(Table):
    """The turning counts of one period."""

    begin: Time = Field(ge=0, description="[s]")
    end: PositiveTime = Field(description="[s]")
    peak_hour_factor: float = Field(
        1.0,
        ge=0.25,
        le=1,
        description="The counts are volumes of an hour of which the busiest quarter has "
        "1 / (4 peak_hour_factor); the period runs at the rate of that quarter.",
    )
    northbound: TurnCounts = TurnCounts()
    eastbound: TurnCounts = TurnCounts()
    southbound: TurnCounts = TurnCounts()
    westbound: TurnCounts = TurnCounts()

    @model_validator(mode="after")
    def _positive_length(self) -> Self:
        if self.begin >= self.end:
            raise ValueError(f"begin ({self.begin:g} s) must lie before end ({self.end:g} s)")
        return self

    def counts(self, approach: str) -> TurnCounts:
        """The flow rates from an approach: counts over ``peak_hour_factor`` (HCM 6, chapter 4)."""
        counts: TurnCounts = getattr(self, approach)
        return counts.scaled(1 / self.peak_hour_factor)

    @property
    def total(self) -> float:
        """All counts together [veh/h]."""
        return sum(self.counts(name).total for name in COMPASS)

    def scaled(self, factor: float) -> Self:
        """The same period with every count multiplied."""
        counts: dict[str, TurnCounts] = {
            name: TurnCounts.model_validate(dict(getattr(self, name).scaled(factor)))
            for name in COMPASS
        }
        return self.model_copy(update=counts)


def busiest(periods: Sequence[Demand], span: float = ANALYSIS_PERIOD) -> Demand:
    """The average of the counts over the busiest span of time, as a period of its own.

    A platoon of a minute so weighs as much as a minute. Of a demand that is shorter than the span,
    it is the average over all of it.

    Args:
        periods: at least one, in any order; no two overlap.
        span: how long [s].
    """
    first = min(period.begin for period in periods)
    last = max(period.end for period in periods)
    span = min(span, last - first)
    ends = {time for period in periods for time in (period.begin, period.end - span)}
    begins = sorted(min(max(time, first), last - span) for time in ends)
    return max((_average(periods, begin, span) for begin in begins), key=lambda made: made.total)


def _average(periods: Sequence[Demand], begin: float, span: float) -> Demand:
    """The counts averaged over a span of time that may reach over several periods."""
    end = begin + span
    weights = [
        max(0.0, min(period.end, end) - max(period.begin, begin)) / span for period in periods
    ]
    counts: dict[str, Any] = {
        name: TurnCounts.model_construct(
            **{
                turn: sum(
                    weight * getattr(period.counts(name), turn)
                    for weight, period in zip(weights, periods, strict=True)
                )
                for turn in TurnCounts.model_fields
            }
        )
        for name in COMPASS
    }
    return Demand.model_construct(begin=begin, end=end, peak_hour_factor=1.0, **counts)

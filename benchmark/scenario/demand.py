"""Turning counts by period."""

from typing import Self

from pydantic import Field, PositiveFloat, model_validator

from benchmark.plumbing.models import Table
from benchmark.scenario.layout import COMPASS

LARGEST_COUNT = 10_000  # veh/h


class TurnCounts(Table):
    """Vehicles per hour from one approach by turn."""

    left: float = Field(0.0, ge=0, le=LARGEST_COUNT, description="[veh/h]")
    cross: float = Field(0.0, ge=0, le=LARGEST_COUNT, description="[veh/h]")
    right: float = Field(0.0, ge=0, le=LARGEST_COUNT, description="[veh/h]")

    def of(self, turn: str) -> float:
        """The count of a turn [veh/h]."""
        return {"L": self.left, "C": self.cross, "R": self.right}[turn]

    @property
    def total(self) -> float:
        """All turns together [veh/h]."""
        return self.left + self.cross + self.right


class Demand(Table):
    """The turning counts of one period."""

    begin: float = Field(ge=0, description="[s]")
    end: PositiveFloat = Field(description="[s]")
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
        """The counts from an approach."""
        counts: TurnCounts = getattr(self, approach)
        return counts

    @property
    def total(self) -> float:
        """All counts together [veh/h]."""
        return sum(self.counts(name).total for name in COMPASS)

    def scaled(self, factor: float) -> Self:
        """The same period with every count multiplied."""
        counts = {
            name: TurnCounts(**{turn: count * factor for turn, count in self.counts(name)})
            for name in COMPASS
        }
        return self.model_copy(update=counts)

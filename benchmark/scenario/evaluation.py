"""How an episode is evaluated: its length, the figures' window, and how far control reaches."""

from typing import Self

from pydantic import Field, PositiveInt, field_validator, model_validator

from benchmark.plumbing.models import Share, Table
from benchmark.scenario.layout import KERB_TURN, DrivingSide
from benchmark.scenario.units import PositiveLength, PositiveSpeed, PositiveTime, Time

MOST_SEEDS = 10_000  # of a study


class Evaluation(Table):
    """How long an episode lasts, from when figures count, and which episodes a study holds."""

    step: PositiveTime = Field(1.0, le=1.0, description="Simulated time per step [s].")
    duration: PositiveTime = Field(1000.0, le=86400, description="Length of an episode [s].")
    warm_up: Time = Field(0.0, ge=0, description="Time before figures count [s].")
    penetration_rates: tuple[Share, ...] = Field(
        (0.4, 0.5, 0.6, 0.7), min_length=1, description="Probabilities that a vehicle is an RV."
    )
    seeds: PositiveInt = Field(
        10, le=MOST_SEEDS, description="The study uses the seeds 1 to this number."
    )

    @field_validator("step")
    @classmethod
    def _whole_milliseconds(cls, step: float) -> float:
        if not 1 <= round(1000 * step, 6) == round(1000 * step):
            raise ValueError(f"{step:g} s; SUMO's clock counts whole milliseconds, as in 0.1")
        return step

    @model_validator(mode="after")
    def _window_exists(self) -> Self:
        if self.warm_up >= self.duration:
            raise ValueError(f"warm_up ({self.warm_up:g} s) must end before duration")
        if self.warm_up >= (last := round(self.duration / self.step) * self.step):
            raise ValueError(
                f"warm_up ({self.warm_up:g} s) must end before the last step ({last:g} s)"
            )
        return self


class Zones(Table):
    """Where the intersection lies and how far control reaches."""

    latitude: float | None = Field(None, ge=-90, le=90, description="Degrees north.")
    longitude: float | None = Field(None, ge=-180, le=180, description="Degrees east.")
    control_zone: PositiveLength = Field(
        100.0, description="Queues and waiting count, and vehicles may be driven, within [m]."
    )
    decision_zone: PositiveLength = Field(30.0, description="RVs decide Go or Stop within [m].")
    speed_cap: PositiveSpeed | None = Field(
        None, description="No vehicle drives faster [m/s]; leave out for none."
    )
    radius: PositiveLength | None = Field(
        None,
        le=60,
        description="Of the kerbs at the corners [m], which sets how wide the box is; default: "
        "SUMO's 4.",
    )
    driving_side: DrivingSide = Field(
        "right", description="Where traffic drives; left turns keep to the kerb on the left."
    )
    priority: tuple[str, ...] = Field(
        (),
        description="Approaches that have priority where stop signs rule; the others stop. Without "
        "it all stop.",
        examples=[["northbound", "southbound"]],
    )

    @property
    def kerb_turn(self) -> str:
        """The turn that keeps to the kerb and is not regulated."""
        return KERB_TURN[self.driving_side]

    @property
    def crossing_turn(self) -> str:
        """The turn that crosses oncoming traffic."""
        return "L" if self.kerb_turn == "R" else "R"

    @field_validator("priority")
    @classmethod
    def _sorted(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(sorted(set(names)))

    @model_validator(mode="after")
    def _zones_nest(self) -> Self:
        if self.decision_zone > self.control_zone:
            raise ValueError(
                f"decision_zone ({self.decision_zone:g} m) must not exceed "
                f"control_zone ({self.control_zone:g} m)"
            )
        return self

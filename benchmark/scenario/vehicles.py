"""Vehicle classes and their drivers."""

from typing import Literal

from pydantic import Field, PositiveFloat

from benchmark.plumbing.models import Share, Table
from benchmark.scenario.units import PositiveLength, PositiveTime


class CarFollowing(Table):
    """What all car-following models share."""

    acceleration: PositiveFloat = Field(2.6, le=10, description="[m/s2]")
    deceleration: PositiveFloat = Field(4.5, le=15, description="[m/s2]")
    headway: PositiveTime = Field(1.0, le=10, description="Desired time headway [s].")
    minimum_gap: PositiveLength = Field(2.5, le=20, description="Gap at standstill [m].")


class Idm(CarFollowing):
    """The Intelligent Driver Model, which the paper's HVs follow."""

    model: Literal["IDM"]


class Krauss(CarFollowing):
    """SUMO's default car-following model, with imperfect drivers."""

    model: Literal["Krauss"]
    imperfection: Share = Field(0.5, description="0 is a perfect driver.")


class VehicleClass(Table):
    """A class of vehicles: its share of the demand, its body and its driver."""

    share: Share
    kind: Literal["passenger", "truck", "bus", "motorcycle"] = Field(
        "passenger", description="SUMO's vehicle class; sets width, emissions and top speed."
    )
    length: PositiveLength | None = Field(None, le=30, description="[m]; default: the kind's.")
    speed_deviation: float = Field(
        0.1, ge=0, le=0.4, description="Standard deviation of desired speed over speed limit."
    )
    car_following: Idm | Krauss = Field(Idm(model="IDM"), discriminator="model")

    @property
    def is_heavy(self) -> bool:
        """Whether it counts as a heavy vehicle."""
        return self.kind in ("truck", "bus")

"""The tables of a scenario file: geometry, demand, vehicles, signal; each validates itself."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, PositiveFloat, PositiveInt, field_validator, model_validator

from benchmark.plumbing.models import Share, Table

TURNS = ("R", "C", "L")  # from the kerb to the centre line
LETTERS = {"northbound": "N", "eastbound": "E", "southbound": "S", "westbound": "W"}
COMPASS = tuple(LETTERS)  # clockwise
LARGEST_COUNT = 10_000  # veh/h

MovementName = Annotated[str, Field(pattern=r"^[NESW]-[LCR]$", examples=["E-L"])]


class Evaluation(Table):
    """How long an episode lasts, from when figures count, and which episodes a study holds."""

    step: PositiveFloat = Field(1.0, le=1.0, description="Simulated time per step [s].")
    duration: PositiveFloat = Field(1000.0, le=86400, description="Length of an episode [s].")
    warm_up: float = Field(0.0, ge=0, description="Time before figures count [s].")
    penetration_rates: tuple[Share, ...] = Field(
        (0.4, 0.5, 0.6, 0.7), min_length=1, description="Probabilities that a vehicle is an RV."
    )
    seeds: PositiveInt = Field(10, description="The study uses the seeds 1 to this number.")

    @model_validator(mode="after")
    def _window_exists(self) -> Self:
        if self.warm_up >= self.duration:
            raise ValueError(f"warm_up ({self.warm_up:g} s) must end before duration")
        if self.warm_up >= (last := round(self.duration / self.step) * self.step):
            raise ValueError(
                f"warm_up ({self.warm_up:g} s) must end before the last step ({last:g} s)"
            )
        return self


class Intersection(Table):
    """Where the intersection lies and how far control reaches."""

    latitude: float | None = Field(None, ge=-90, le=90, description="Degrees north.")
    longitude: float | None = Field(None, ge=-180, le=180, description="Degrees east.")
    control_zone: PositiveFloat = Field(
        100.0, description="Queues and waiting count, and vehicles may be driven, within [m]."
    )
    decision_zone: PositiveFloat = Field(30.0, description="RVs decide Go or Stop within [m].")
    speed_cap: PositiveFloat | None = Field(
        None, description="No vehicle drives faster [m/s]; leave out for none."
    )

    @model_validator(mode="after")
    def _zones_nest(self) -> Self:
        if self.decision_zone > self.control_zone:
            raise ValueError(
                f"decision_zone ({self.decision_zone:g} m) must not exceed "
                f"control_zone ({self.control_zone:g} m)"
            )
        return self


class Approach(Table):
    """A road leg by direction of travel, and the road beyond in the same direction."""

    heading: float = Field(description="Direction of travel [degrees], 0 is north, 90 east.")
    length: PositiveFloat = Field(le=5000, description="Upstream of the entrance [m].")
    bay: PositiveFloat | None = Field(
        None, description="Length of the turn lanes before the entrance [m]; default: length."
    )
    speed_limit: PositiveFloat = Field(le=60, description="[m/s]")
    lanes: str = Field(
        description="Lanes at the entrance from the kerb to the centre line, by the turns each "
        "serves: R right, C cross, L left; a shared lane joins letters, as in 'RC C CL'.",
        examples=["R C C L"],
    )
    upstream_lanes: PositiveInt | None = Field(
        None, le=8, description="Lanes before the bay; default: as many as at the entrance."
    )
    exit_lanes: PositiveInt | None = Field(
        None, le=8, description="Lanes of the road beyond; default: the lanes of its other side."
    )
    slip_lane: bool = Field(
        False, description="Right turns leave before the stop line and yield, never wait for green."
    )

    @field_validator("heading")
    @classmethod
    def _on_the_circle(cls, heading: float) -> float:
        return heading % 360.0

    @field_validator("lanes")
    @classmethod
    def _lanes_in_order(cls, lanes: str) -> str:
        tokens = lanes.upper().split()
        if not tokens:
            raise ValueError('expected lanes such as "R C C L"')
        for token in tokens:
            for letter in token:
                if letter not in TURNS:
                    raise ValueError(f'unknown turn "{letter}" in "{lanes}"; use R, C or L')
            if len(set(token)) < len(token):
                raise ValueError(f'lane "{token}" in "{lanes}" names a turn twice')
        ranks = [sorted(TURNS.index(letter) for letter in token) for token in tokens]
        if any(right[-1] > left[0] for right, left in pairwise(ranks)):
            raise ValueError(f'ways cross in "{lanes}"; list lanes from kerb to centre: R, C, L')
        return " ".join("".join(sorted(token, key="RCL".index)) for token in tokens)

    @model_validator(mode="after")
    def _bay_fits(self) -> Self:
        if self.bay is not None and self.bay > self.length:
            raise ValueError(f"bay ({self.bay:g} m) is longer than length ({self.length:g} m)")
        if self.upstream_lanes not in (None, len(self.lane_turns)) and not self.has_bay:
            raise ValueError(
                f"upstream_lanes ({self.upstream_lanes}) differs from the lanes at the entrance; "
                f"add a bay shorter than length in which they change"
            )
        return self

    @property
    def lane_turns(self) -> tuple[str, ...]:
        """The turns of each lane at the entrance, from the kerb, as in ``("R", "C", "CL")``."""
        return tuple(self.lanes.split())

    @property
    def has_bay(self) -> bool:
        """Whether the road changes its lanes before the entrance."""
        return self.bay is not None and self.bay < self.length


class Approaches(Table):
    """The approaches by direction of travel: any three or four."""

    northbound: Approach | None = None
    eastbound: Approach | None = None
    southbound: Approach | None = None
    westbound: Approach | None = None

    def items(self) -> Iterator[tuple[str, Approach]]:
        """The approaches that exist, clockwise."""
        for name in COMPASS:
            if (approach := getattr(self, name)) is not None:
                yield name, approach

    def names(self) -> tuple[str, ...]:
        """The names of the approaches that exist, clockwise."""
        return tuple(name for name, _ in self.items())

    @model_validator(mode="after")
    def _clockwise(self) -> Self:
        headings = [approach.heading for _, approach in self.items()]
        if len(headings) < 3:
            raise ValueError(f"expected three or four approaches of {', '.join(COMPASS)}")
        turns = [(b - a) % 360 for a, b in pairwise([*headings, headings[0]])]
        if abs(sum(turns) - 360) > 1e-6 or min(turns) < 20:
            raise ValueError(
                "headings must run clockwise from northbound over eastbound and southbound to "
                f"westbound, at least 20 degrees apart; got {', '.join(f'{h:g}' for h in headings)}"
            )
        return self


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


class CarFollowing(Table):
    """What all car-following models share."""

    acceleration: PositiveFloat = Field(2.6, le=10, description="[m/s2]")
    deceleration: PositiveFloat = Field(4.5, le=15, description="[m/s2]")
    headway: PositiveFloat = Field(1.0, le=10, description="Desired time headway [s].")
    minimum_gap: PositiveFloat = Field(2.5, le=20, description="Gap at standstill [m].")


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
    length: PositiveFloat | None = Field(None, le=30, description="[m]; default: the kind's.")
    speed_deviation: float = Field(
        0.1, ge=0, le=0.4, description="Standard deviation of desired speed over speed limit."
    )
    car_following: Idm | Krauss = Field(Idm(model="IDM"), discriminator="model")


class Phase(Table):
    """Movements that are green together."""

    movements: tuple[MovementName, ...] = Field(min_length=1)
    permitted: tuple[MovementName, ...] = Field(
        (), description="Of these, the ones that yield to conflicting greens (permitted lefts)."
    )
    green: PositiveFloat = Field(
        le=300, description="Green time [s]; under an actuated program the longest."
    )
    minimum_green: PositiveFloat = Field(
        5.0,
        le=300,
        description="The shortest green [s] of an actuated program or before another Phase.",
    )

    @field_validator("movements", "permitted")
    @classmethod
    def _sorted(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(sorted(set(names)))

    @model_validator(mode="after")
    def _permitted_are_green(self) -> Self:
        if extra := set(self.permitted) - set(self.movements):
            raise ValueError(f"permitted {', '.join(sorted(extra))} is not among movements")
        if self.minimum_green > self.green:
            raise ValueError("minimum_green must not exceed green")
        return self

    @property
    def name(self) -> str:
        """The phase's name in commands and drawings, as in ``"N-C S-C"``."""
        return " ".join(self.movements)


class Signal(Table):
    """The signal program that rules under ``traffic-light``."""

    kind: Literal["fixed", "actuated"] = "fixed"
    yellow: float = Field(4.0, ge=0, le=10, description="[s]")
    all_red: float = Field(1.0, ge=0, le=10, description="[s]")
    maximum_gap: PositiveFloat = Field(
        3.0, le=10, description="Gap between vehicles that ends an actuated green [s]."
    )
    phases: tuple[Phase, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [phase.name for phase in self.phases]
        if len(set(names)) < len(names):
            raise ValueError("two phases serve the same movements; merge them")
        return self

    @property
    def cycle(self) -> float:
        """The cycle time with every green at its length in the file [s]."""
        return sum(phase.green + self.yellow + self.all_red for phase in self.phases)

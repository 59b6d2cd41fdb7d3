"""The roads of a drawn scenario: approaches by compass name, their lanes, and where turns lead."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Literal, Self

from pydantic import Field, PositiveInt, field_validator, model_validator

from benchmark.plumbing.models import Share, Table
from benchmark.scenario.units import Length, PositiveLength, PositiveSpeed

TURNS = ("R", "C", "L", "U")  # from the kerb to the centre line
TURNS_ON_THE_LEFT = ("L", "C", "R", "U")  # where traffic drives on the left
DrivingSide = Literal["right", "left"]
ORDERS: dict[DrivingSide, tuple[str, ...]] = {"right": TURNS, "left": TURNS_ON_THE_LEFT}
KERB_TURN = {side: order[0] for side, order in ORDERS.items()}
LETTERS = {"northbound": "N", "eastbound": "E", "southbound": "S", "westbound": "W"}
COMPASS = tuple(LETTERS)  # clockwise


def _in_order(tokens: Sequence[str], order: tuple[str, ...]) -> bool:
    """Whether the ways of neighbouring lanes do not cross."""
    ranks = [sorted(order.index(letter) for letter in token) for token in tokens]
    return all(outer[-1] <= inner[0] for outer, inner in pairwise(ranks))


def ways_cross(lanes: str, side: DrivingSide) -> str:
    """What is wrong with lanes in another order than where traffic drives on a side."""
    order = ", ".join(ORDERS[side])
    return f'ways cross in "{lanes}"; list lanes from kerb to centre: {order}'


class Approach(Table):
    """A road leg by direction of travel, and the road beyond in the same direction."""

    heading: float = Field(description="Direction of travel [degrees], 0 is north, 90 east.")
    length: PositiveLength = Field(le=5000, description="Upstream of the entrance [m].")
    bay: Length | None = Field(
        None, ge=5, description="Length of the turn lanes before the entrance [m]; default: length."
    )
    speed_limit: PositiveSpeed = Field(le=60, description="[m/s]")
    lanes: str = Field(
        "",
        description="Lanes at the entrance from the kerb to the centre line, by the turns each "
        "serves: R right, C cross, L left, U back; a shared lane joins letters, as in 'RC C LU'. "
        "Where traffic drives on the left the order is L, C, R, U. Without it nobody arrives "
        "here: vehicles only leave on this leg.",
        examples=["R C C L"],
    )
    upstream_lanes: PositiveInt | None = Field(
        None, le=8, description="Lanes before the bay; default: as many as at the entrance."
    )
    exit_lanes: int | None = Field(
        None,
        ge=0,
        le=8,
        description="Lanes of the road beyond; default: the lanes of its other side. 0: nobody "
        "leaves there, the leg is one-way towards the intersection.",
    )
    slip_lane: bool = Field(
        False,
        description="Right turns (left ones where traffic drives on the left) leave before the "
        "stop line and yield, never wait for green.",
    )
    heavy_vehicles: Share | None = Field(
        None,
        description="Share of trucks and buses among the vehicles that arrive here; default: that "
        "of the vehicle classes.",
    )
    right_on_red: bool = Field(
        True,
        description="Whether right turns (left ones where traffic drives on the left) may go on "
        "red, after a stop; false: they wait.",
    )

    @field_validator("heading")
    @classmethod
    def _on_the_circle(cls, heading: float) -> float:
        return heading % 360.0

    @field_validator("lanes")
    @classmethod
    def _lanes_in_order(cls, lanes: str) -> str:
        tokens = lanes.upper().split()
        for token in tokens:
            for letter in token:
                if letter not in TURNS:
                    raise ValueError(f'unknown turn "{letter}" in "{lanes}"; use R, C, L or U')
            if len(set(token)) < len(token):
                raise ValueError(f'lane "{token}" in "{lanes}" names a turn twice')
        for order in ORDERS.values():
            if _in_order(tokens, order):
                return " ".join("".join(sorted(token, key=order.index)) for token in tokens)
        raise ValueError(ways_cross(lanes, "right"))

    @model_validator(mode="after")
    def _bay_fits(self) -> Self:
        if self.bay is not None and self.bay > self.length:
            raise ValueError(f"bay ({self.bay:g} m) is longer than length ({self.length:g} m)")
        if not self.lane_turns and (self.bay or self.upstream_lanes or self.slip_lane):
            raise ValueError(
                'without lanes nobody arrives here; give lanes such as "R C C L", or remove bay, '
                "upstream_lanes and slip_lane"
            )
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

    def in_order(self, side: DrivingSide) -> bool:
        """Whether the lanes are in order where traffic drives on a side."""
        return _in_order(self.lane_turns, ORDERS[side])

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

    def entering(self) -> Iterator[tuple[str, Approach]]:
        """The approaches on which vehicles arrive, clockwise."""
        return ((name, approach) for name, approach in self.items() if approach.lane_turns)

    def of(self, name: str) -> Approach:
        """The approach of a name that exists."""
        approach: Approach = getattr(self, name)
        return approach

    def exit_leg(self, approach: str, turn: str) -> str | None:
        """The approach on whose leg a turn leaves the intersection, or None if there is none.

        A vehicle that travels north and turns right leaves on the eastern leg, which is the one
        that westbound vehicles arrive on.
        """
        steps = {"U": 0, "L": 1, "C": 2, "R": 3}[turn]
        leg = COMPASS[(COMPASS.index(approach) + steps) % 4]
        return leg if getattr(self, leg) is not None and self.exit_lanes(leg) != 0 else None

    def exit_lanes(self, leg: str) -> int | None:
        """What the file says of the lanes that leave on an approach's leg; None if nothing."""
        opposite = getattr(self, COMPASS[(COMPASS.index(leg) + 2) % 4])
        return None if opposite is None else opposite.exit_lanes

    def served_turns(self, approach: str) -> set[str]:
        """The turns that some lane of the approach serves."""
        return set("".join(self.of(approach).lane_turns))

    def movements(self) -> list[str]:
        """The names of the movements that lanes serve, as in ``E-L``; sorted."""
        return sorted(
            f"{LETTERS[name]}-{turn}" for name in self.names() for turn in self.served_turns(name)
        )

    def lanes_beyond(self, approach: str) -> int | None:
        """The lanes of the other side of the road beyond an approach, None without such a road."""
        if (leg := self.exit_leg(approach, "C")) is None:
            return None
        other = self.of(leg)
        return other.upstream_lanes or len(other.lane_turns) or 1

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

"""A signal program: phases named by the movements that are green together."""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from benchmark.plumbing.models import Table
from benchmark.scenario.units import PositiveTime, Time

MovementName = Annotated[str, Field(min_length=1, max_length=100, examples=["E-L"])]


class SignalPhase(Table):
    """Movements that are green together."""

    movements: tuple[MovementName, ...] = Field(min_length=1)
    permitted: tuple[MovementName, ...] = Field(
        (), description="Of these, the ones that yield to conflicting greens (permitted lefts)."
    )
    green: PositiveTime = Field(
        le=300, description="Green time [s]; under an actuated program the longest."
    )
    minimum_green: PositiveTime = Field(
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
    yellow: Time = Field(4.0, ge=0, le=10, description="[s]")
    all_red: Time = Field(1.0, ge=0, le=10, description="[s]")
    maximum_gap: PositiveTime = Field(
        3.0, le=10, description="Gap between vehicles that ends an actuated green [s]."
    )
    phases: tuple[SignalPhase, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [phase.name for phase in self.phases]
        if len(set(names)) < len(names):
            raise ValueError("two phases serve the same movements; merge them")
        return self

    def movements_by_phase(self) -> dict[str, frozenset[str]]:
        """The movements that each phase serves, by its name."""
        return {phase.name: frozenset(phase.movements) for phase in self.phases}

    @property
    def permitted(self) -> frozenset[str]:
        """The movements that some phase lets filter through gaps."""
        return frozenset(name for phase in self.phases for name in phase.permitted)

    @property
    def words(self) -> str:
        """The program in a line, as in ``fixed, cycle 64 s (yellow 3 s, all red 1 s): ...``."""
        upto = "up to " if self.kind == "actuated" else ""
        greens = (
            f"{phase.name} {f'{phase.minimum_green:g} to ' if upto else ''}{phase.green:g} s"
            for phase in self.phases
        )
        return (
            f"{self.kind}, cycle {upto}{self.cycle:g} s (yellow {self.yellow:g} s, "
            f"all red {self.all_red:g} s): {'; '.join(greens)}"
        )

    @property
    def cycle(self) -> float:
        """The cycle time with every green at its length in the file [s]."""
        return sum(phase.green + self.yellow + self.all_red for phase in self.phases)

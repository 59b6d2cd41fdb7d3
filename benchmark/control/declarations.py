"""What a controller declares of itself, and where it is therefore not run."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from numbers import Real
from typing import Literal, Self, get_args

from benchmark.control import reference as naming
from benchmark.control.controller import Controller
from benchmark.control.intersection import Intersection

Rules = Literal["signals", "stop signs", "robot vehicles"]
Arbitration = Literal["flexible", "own"]
CHOICES = {"rules": get_args(Rules), "arbitration": get_args(Arbitration)}


@dataclass(frozen=True)
class Declaration:
    """What a controller's class says of itself, wherever it runs; see ``Controller``."""

    reference: str  # as ``benchmark.control.plugins.find_controller`` reads it from any folder
    rules: Rules
    arbitration: Arbitration
    needs_robot_vehicles: bool
    rates: tuple[float, float]
    approaches: frozenset[int] | None  # None: any number

    @classmethod
    def of(cls, reference: str, kind: type[Controller]) -> Self:
        """The declaration of a class without ``mistake``."""
        least, greatest = kind.rates
        return cls(
            reference=reference,
            rules=kind.rules,
            arbitration=kind.arbitration,
            needs_robot_vehicles=bool(kind.needs_robot_vehicles),
            rates=(float(least), float(greatest)),
            approaches=None if kind.approaches is None else frozenset(kind.approaches),
        )

    @property
    def label(self) -> str:
        """The reference as records and tables have it: a file by its name alone."""
        return naming.label(self.reference)

    @property
    def arbitrated(self) -> Arbitration | None:
        """Who arbitrates conflicts; None where signals or signs do."""
        return self.arbitration if self.rules == "robot vehicles" else None

    def unmet(self, intersections: Collection[Intersection], rate: float | None) -> str | None:
        """Why intersections at a penetration rate are none for the controller; None if they are.

        Signals are for ``Controller.supports`` to ask for: a controller may bring its own program.
        """
        for intersection in intersections:
            count = len(intersection.approaches)
            if self.approaches is not None and count not in self.approaches:
                place = "the scenario" if len(intersections) == 1 else intersection.id
                return f"it needs {_numbers(self.approaches)} approaches, and {place} has {count}"
        least, greatest = self.rates
        if rate is not None and not least <= rate <= greatest:
            return f"it needs {self._span()} RVs, and the rate is {100 * rate:g} %"
        return None

    def in_words(self) -> str:
        """The declaration as a line for readers."""
        return "; ".join(self._parts())

    def _parts(self) -> Iterator[str]:
        if self.rules == "signals":
            yield "lights on"
        elif self.rules == "stop signs":
            yield "stop signs"
        else:
            yield f"lights dark, {self.arbitration} arbitration"
        yield f"{self._span()} RVs" if self.needs_robot_vehicles else "commands no vehicle"
        numbers = "any number of" if self.approaches is None else _numbers(self.approaches)
        yield f"{numbers} approaches"

    def _span(self) -> str:
        return f"{100 * self.rates[0]:g} to {100 * self.rates[1]:g} %"


def mistake(kind: type[Controller]) -> str | None:
    """What is wrong with a controller's declarations; None if nothing is."""
    for key, choices in CHOICES.items():
        if (value := getattr(kind, key)) not in choices:
            *others, last = (f'"{choice}"' for choice in choices)
            return f"{key} = {value!r}; expected {', '.join(others)} or {last}"
    if not _is_span(kind.rates):
        return f"rates = {kind.rates!r}; expected the least and the greatest, as in (0.4, 1.0)"
    if kind.approaches is not None and not _are_counts(kind.approaches):
        return f"approaches = {kind.approaches!r}; expected whole numbers, as in {{3, 4}}"
    return None


def _numbers(approaches: Collection[int]) -> str:
    return " or ".join(map(str, sorted(approaches)))


def _is_span(rates: object) -> bool:
    return (
        isinstance(rates, tuple | list)
        and len(rates) == 2
        and all(isinstance(rate, Real) for rate in rates)
        and 0 <= rates[0] <= rates[1] <= 1
    )


def _are_counts(approaches: object) -> bool:
    return (
        isinstance(approaches, Collection)
        and bool(approaches)
        and all(type(count) is int and count > 0 for count in approaches)
    )

"""What a controller declares that it needs, and where it is therefore not run."""

from collections.abc import Collection, Iterator
from numbers import Real
from typing import Literal, Protocol

from benchmark.scenario.scenario import Scenario

CHOICES = {"rules": ("signals", "robot vehicles"), "arbitration": ("flexible", "own")}


class Declares(Protocol):
    """What a controller's class says of itself; see ``benchmark.control.controller.Controller``."""

    @property
    def rules(self) -> Literal["signals", "robot vehicles"]:
        """What rules the intersection."""

    @property
    def arbitration(self) -> Literal["flexible", "own"]:
        """Who arbitrates conflicts."""

    @property
    def needs_robot_vehicles(self) -> bool:
        """Whether it commands vehicles."""

    @property
    def rates(self) -> tuple[float, float]:
        """The least and the greatest penetration rate."""

    @property
    def approaches(self) -> Collection[int] | None:
        """The numbers of approaches it can steer; None: any."""


def unmet(kind: Declares, scenario: Scenario, rate: float | None) -> str | None:
    """Why a scenario at a penetration rate is none for a controller; None if it is.

    Signals are for ``Controller.supports`` to ask for, as a controller may bring its own program.
    """
    count = len(scenario.approaches.names())
    if kind.approaches is not None and count not in kind.approaches:
        return f"it needs {_numbers(kind.approaches)} approaches, and the scenario has {count}"
    least, greatest = kind.rates
    if rate is not None and not least <= rate <= greatest:
        return f"it needs {_span(kind)} RVs, and the rate is {100 * rate:g} %"
    return None


def mistake(kind: Declares) -> str | None:
    """What is wrong with a controller's declarations; None if nothing is."""
    for key, choices in CHOICES.items():
        if (value := getattr(kind, key)) not in choices:
            return f'{key} = {value!r}; expected "{choices[0]}" or "{choices[1]}"'
    if not _is_span(kind.rates):
        return f"rates = {kind.rates!r}; expected the least and the greatest, as in (0.4, 1.0)"
    if kind.approaches is not None and not _are_counts(kind.approaches):
        return f"approaches = {kind.approaches!r}; expected whole numbers, as in {{3, 4}}"
    return None


def declared(kind: Declares) -> str:
    """What a controller declares, in words."""
    return "; ".join(_declared(kind))


def _declared(kind: Declares) -> Iterator[str]:
    if kind.rules == "signals":
        yield "lights on"
    else:
        yield f"lights dark, {kind.arbitration} arbitration"
    yield f"{_span(kind)} RVs" if kind.needs_robot_vehicles else "commands no vehicle"
    numbers = "any number of" if kind.approaches is None else _numbers(kind.approaches)
    yield f"{numbers} approaches"


def _span(kind: Declares) -> str:
    return f"{100 * kind.rates[0]:g} to {100 * kind.rates[1]:g} %"


def _numbers(approaches: Collection[int]) -> str:
    return " or ".join(map(str, sorted(approaches)))


def _is_span(rates: object) -> bool:
    return (
        isinstance(rates, tuple | list)
        and len(rates) == 2
        and all(isinstance(one, Real) for one in rates)
        and 0 <= rates[0] <= rates[1] <= 1
    )


def _are_counts(approaches: object) -> bool:
    return (
        isinstance(approaches, Collection)
        and bool(approaches)
        and all(type(one) is int and one > 0 for one in approaches)
    )

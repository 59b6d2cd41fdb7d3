"""The contract: what a controller is and the commands it may give."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState
from benchmark.control.training import Training
from benchmark.plumbing.errors import ControllerError
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal


@dataclass(frozen=True, slots=True)
class Go:
    """An RV in the decision zone enters the intersection with full acceleration.

    Full within what its car-following model finds safe, which SUMO's checks enforce.
    """


@dataclass(frozen=True, slots=True)
class Stop:
    """An RV in the decision zone brakes smoothly to the entrance and waits there."""


@dataclass(frozen=True, slots=True)
class Drive:
    """An RV in the control zone takes an acceleration and perhaps another lane.

    Under the flexible arbitration it drives up to the entrance but not over it: only a Go that
    the arbitration lets pass enters.
    """

    acceleration: float  # m/s2, between -body.deceleration and body.acceleration
    lane_change: Literal[-1, 0, 1] = 0  # 1 towards the centre line, -1 to the kerb, 0 stays


@dataclass(frozen=True, slots=True)
class Phase:
    """A signal shows this phase, after yellow and all-red for the one before.

    The first Phase of an episode takes over from the program that runs at once, so give it in the
    first step, before anybody has arrived.
    """

    name: str  # one of Intersection.phases


Command = Go | Stop | Drive | Phase


def expect_mapping(controller: str, commands: object) -> None:
    """Refuse an answer that is no commands at all.

    Raises:
        ControllerError: it is not a mapping; the message names the controller.
    """
    if not isinstance(commands, Mapping):
        raise ControllerError(
            f"{controller}: act returned {type(commands).__name__}; "
            "expected a mapping of ids to commands"
        )


class Controller(ABC):
    """Steers one intersection through one episode at a time.

    A controller is found by its entry point in the group ``rightofway.controllers``, or in a file
    or module as ``file.py:Class``; the first line of its docstring describes it in tables. The
    keyword arguments of its constructor are its options, all with defaults.

    What it needs it declares: whether signals rule (``rules``), and where it can be run
    (``rates``, ``approaches``). Elsewhere it is skipped, and the record says why; ``supports`` is
    for reasons beyond these.
    """

    rules: ClassVar[Literal["signals", "stop signs", "robot vehicles"]] = "robot vehicles"
    """What rules the intersection: lights on; stop signs in their place; or lights dark (every
    light shows G).

    Stop signs are for all approaches but those that the scenario gives priority.
    """

    arbitration: ClassVar[Literal["flexible", "own"]] = "flexible"
    """Whether Go passes Wang's conflict arbitration, or the controller brings its own."""

    needs_robot_vehicles: ClassVar[bool] = True
    """False: it commands no vehicle, so it is run once for all penetration rates, with no RVs."""

    rates: ClassVar[tuple[float, float]] = (0.0, 1.0)
    """The least and the greatest penetration rate it is made for."""

    approaches: ClassVar[Collection[int] | None] = None
    """How many approaches it can steer, as in ``{3, 4}``; None: any number."""

    weights_hash: str | None = None
    """SHA-256 of learned weights, for the record."""

    trained_on: Sequence[Training] | None = None
    """The traffic that weights or settings were fitted to, for the record.

    A row of the leaderboard that is evaluated on any of it is flagged.
    """

    def supports(self, scenario: Scenario) -> str | None:
        """Why the scenario is to be skipped, or None if the controller can run on it."""
        if self.rules == "signals" and scenario.programs.keys() < scenario.junctions.keys():
            return "the scenario has no signal"
        return None

    def signal(self, scenario: Scenario, junction: str) -> Signal | None:
        """The program that SUMO runs where signals rule, until the first ``Phase`` command.

        Args:
            scenario: where.
            junction: the id of the intersection whose lights run it.
        """
        return scenario.junctions[junction].signal

    @abstractmethod
    def reset(self, intersection: Intersection, seed: int) -> None:
        """A new episode begins; forget the one before.

        Args:
            intersection: lanes, movements and conflicts, the same for every controller.
            seed: the only source of randomness a controller may use.
        """

    @abstractmethod
    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """The commands for the next step.

        Args:
            state: the traffic now.

        Returns:
            RV id, or the intersection's id for a ``Phase``, to command. An RV without a command
            drives itself as an HV does.
        """

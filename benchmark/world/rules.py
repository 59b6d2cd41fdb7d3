"""Who may move what: limits on commands, the arbitration of conflicts, and what commands mean.

Pure decisions on a state; ``benchmark.study.episode`` carries them out through the simulation.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Literal

from benchmark.control.controller import Command, Drive, Go, Phase, Stop
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle
from benchmark.plumbing.errors import ControllerError

STOP_MARGIN = 1.0  # m before the entrance at which a stopped RV's front comes to rest
COMFORTABLE = 2.0  # m/s2, the braking of a Stop where there is room for it
CELLS_FOR_LONGEST = 3  # occupied cells that hold back the longest waiting movement
CELLS_FOR_OTHERS = 8  # and the others (flexible arbitration of Wang et al.)
MOST_REASONS = 100  # of refusals that are told apart; a phase's name is the controller's choice
OTHER = "a command refused: for one of many more reasons"
ROUNDING = 1e-6  # m/s2 a controller may be off a limit by floating point of 32 bits


@dataclass(frozen=True)
class Orders:
    """What is to happen in the next step."""

    speeds: Mapping[str, float] = field(default_factory=dict)  # RV -> m/s
    lanes: Mapping[str, int] = field(default_factory=dict)  # RV -> index of a lane of its edge
    released: frozenset[str] = frozenset()  # RVs that drive themselves again
    phase: str | None = None
    held_back: frozenset[str] = frozenset()  # RVs whose Go the arbitration held back
    told: Mapping[str, Command] = field(default_factory=dict, compare=False)
    """RV -> its command, refused ones left out, for onlookers."""


class Rules:
    """The rules of one intersection in one episode.

    Args:
        intersection: where.
        controller: the controller's name, for messages.
        arbitration: whether Go commands pass the flexible arbitration.
        lights_on: whether signals rule, so that ``Phase`` is legal.
    """

    def __init__(
        self,
        intersection: Intersection,
        controller: str,
        arbitration: Literal["flexible", "own"],
        lights_on: bool,
    ) -> None:
        self.refusals: Counter[str] = Counter()  # reason -> times
        self.listener: Callable[[Mapping[str, Command]], None] | None = None  # told every answer
        self.held_back = 0  # Go commands that the arbitration held back
        self._intersection, self._controller = intersection, controller
        self._arbitration, self._lights_on = arbitration, lights_on
        self._commanded: frozenset[str] = frozenset()
        self._cleared: frozenset[str] = frozenset()

    def decide(self, state: TrafficState, commands: Mapping[str, Command]) -> Orders:
        """Turn a controller's commands into orders.

        Illegal commands are refused and counted; the others stand.

        Raises:
            ControllerError: the answer is not a mapping of ids to commands at all.
        """
        expect_mapping(self._controller, commands)
        if self.listener is not None:
            self.listener(commands)
        if not commands and not self._commanded:
            return Orders()
        vehicles = {vehicle.id: vehicle for vehicle in state.vehicles}
        speeds: dict[str, float] = {}
        lanes: dict[str, int] = {}
        told: dict[str, Command] = {}
        held: set[str] = set()
        cleared: set[str] = set()
        phase = None
        conflicts: dict[str, bool] = {}  # movement -> whether a Go of it is held back
        for target, command in commands.items():
            if reason := self._refusal(vehicles, target, command):
                known = reason in self.refusals or len(self.refusals) < MOST_REASONS
                self.refusals[reason if known else f"{self._controller}: {OTHER}"] += 1
            elif isinstance(command, Phase):
                phase = command.name
            else:
                vehicle = vehicles[target]
                if isinstance(command, Go):
                    if self._may_enter(state, vehicle, conflicts):
                        cleared.add(target)
                    else:
                        held.add(target)
                elif isinstance(command, Drive) and command.lane_change:
                    side = int(command.lane_change)  # libsumo takes no float and no numpy integer
                    lanes[target] = self._intersection.lanes[vehicle.lane].index + side
                told[target] = _plain(command)
                speeds[target] = self._speed(vehicle, command, target in cleared)
        released = self._commanded - speeds.keys()
        self._commanded, self._cleared = frozenset(speeds), frozenset(cleared)
        self.held_back += len(held)
        return Orders(speeds, lanes, released, phase, frozenset(held), told)

    # --- limits ----------------------------------------------------------------------------

    def _refusal(
        self, vehicles: Mapping[str, Vehicle], target: str, command: Command
    ) -> str | None:
        """Why a command is illegal, naming the controller; None if it is not."""
        reason = self._why_not(vehicles, target, command)
        return f"{self._controller}: {type(command).__name__} refused: {reason}" if reason else None

    def _why_not(
        self, vehicles: Mapping[str, Vehicle], target: str, command: Command
    ) -> str | None:
        kind = type(command)
        if kind is Phase:
            return self._why_no_phase(target, command)  # type: ignore[arg-type]
        if kind not in (Go, Stop, Drive):
            return "it is not a command; expected Go, Stop, Drive or Phase"
        if (vehicle := vehicles.get(target)) is None:
            return "the vehicle is not in the control zone"
        if not vehicle.is_robot:
            return "the vehicle is not an RV"
        if isinstance(command, Drive):
            return self._why_no_drive(vehicle, command)
        if vehicle.distance > self._intersection.decision_zone:
            return "the vehicle is not in the decision zone"
        return None

    def _why_no_phase(self, target: str, command: Phase) -> str | None:
        if not self._lights_on:
            return "the lights are dark under this controller"
        if target != self._intersection.id:
            return f'there is no such signal; expected "{self._intersection.id}"'
        if command.name not in self._intersection.phases:
            return f'unknown phase "{command.name}"'
        return None

    def _why_no_drive(self, vehicle: Vehicle, command: Drive) -> str | None:
        low, high = -vehicle.body.deceleration, vehicle.body.acceleration
        value = command.acceleration
        if not isinstance(value, Real) or not math.isfinite(value):
            return "the acceleration is not a finite number"
        if not low - ROUNDING <= float(value) <= high + ROUNDING:
            return f"the acceleration is outside [{low:g}, {high:g}] m/s2"
        if command.lane_change not in (-1, 0, 1):
            return "the lane change is not -1, 0 or 1"
        if command.lane_change and not self._lane_serves(vehicle, command.lane_change):
            return "the lane on that side does not serve the vehicle's movement"
        return None

    def _lane_serves(self, vehicle: Vehicle, side: int) -> bool:
        if (lane := self._intersection.lanes.get(vehicle.lane)) is None:
            return False  # upstream of the turn bay
        return any(
            other.approach == lane.approach
            and other.index == lane.index + side
            and vehicle.movement in other.movements
            for other in self._intersection.lanes.values()
        )

    # --- arbitration -----------------------------------------------------------------------

    def _may_enter(self, state: TrafficState, vehicle: Vehicle, conflicts: dict[str, bool]) -> bool:
        if self._arbitration == "own":
            return True
        if vehicle.movement not in conflicts:
            conflicts[vehicle.movement] = held_by_conflict(state, vehicle.movement)
        if not conflicts[vehicle.movement]:
            return True
        return vehicle.id in self._cleared and not can_stop(vehicle)

    # --- what commands mean ----------------------------------------------------------------

    def _speed(self, vehicle: Vehicle, command: Command, cleared: bool) -> float:
        """The speed to ask of an RV for the next step [m/s]."""
        step = self._intersection.step
        fastest = vehicle.speed + vehicle.body.acceleration * step
        if cleared:
            return fastest
        if isinstance(command, Drive):
            wanted = vehicle.speed + float(command.acceleration) * step
            if self._arbitration == "own":
                return wanted
            return min(wanted, stopping_speed(vehicle.distance, vehicle.body.deceleration, step))
        return min(fastest, stopping_speed(vehicle.distance, COMFORTABLE, step))


def _plain(command: Command) -> Command:
    """A command for an RV in plain numbers, whatever kind of number the controller gave."""
    if isinstance(command, Drive):
        side: Literal[-1, 0, 1] = int(command.lane_change)  # type: ignore[assignment]
        return Drive(float(command.acceleration), side)
    return command


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


def held_by_conflict(state: TrafficState, movement: str) -> bool:
    """Whether the flexible arbitration holds back a Go of a movement.

    A Go waits while a conflicting movement has a vehicle in the first eight of its ten cells; for
    the movement with the longest mean waiting only the first three count (Wang et al., conflict
    mechanism "flexible").
    """
    cells = CELLS_FOR_LONGEST if movement == state.longest_waiting else CELLS_FOR_OTHERS
    conflicts = state.intersection.movements[movement].conflicts
    return any(
        crossing.movement in conflicts and crossing.cell < cells for crossing in state.inside
    )


def stopping_speed(distance: float, deceleration: float, step: float) -> float:
    """The greatest speed in the next step from which braking ends before the entrance [m/s].

    After a step at speed v the rest of the way must hold the braking distance:
    ``distance - STOP_MARGIN - v * step >= v**2 / (2 * deceleration)``, solved for v.

    Args:
        distance: to the entrance [m].
        deceleration: positive [m/s2].
        step: simulated time per step [s].
    """
    room = max(0.0, distance - STOP_MARGIN)
    change = deceleration * step
    return math.sqrt(change * change + 2 * deceleration * room) - change


def undecided(state: TrafficState) -> list[Vehicle]:
    """The RVs in the decision zone that Go and Stop would give different orders.

    The others accelerate fully under both, being far from the entrance for their speed, or are
    stopped under both, because the flexible arbitration would hold their Go back.
    """
    step, blocked = state.intersection.step, dict[str, bool]()
    found = []
    for vehicle in state.deciding:
        fastest = vehicle.speed + vehicle.body.acceleration * step
        if fastest <= stopping_speed(vehicle.distance, COMFORTABLE, step):
            continue
        if (movement := vehicle.movement) not in blocked:
            blocked[movement] = held_by_conflict(state, movement)
        if not (blocked[movement] and can_stop(vehicle)):
            found.append(vehicle)
    return found


def can_stop(vehicle: Vehicle) -> bool:
    """Whether braking as hard as it can would end before the entrance."""
    return vehicle.speed**2 / (2 * vehicle.body.deceleration) < vehicle.distance

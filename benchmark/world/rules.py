"""Who may move what: limits on commands, the arbitration of conflicts, and what commands mean.

Pure decisions on a state; ``benchmark.world.world`` carries them out through the simulation.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Literal

from benchmark.control.arbitration import COMFORTABLE, can_stop, held_by_conflict, stopping_speed
from benchmark.control.controller import Command, Drive, Go, Phase, Stop, expect_mapping
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle

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

    def _may_enter(self, state: TrafficState, vehicle: Vehicle, conflicts: dict[str, bool]) -> bool:
        if self._arbitration == "own":
            return True
        if vehicle.movement not in conflicts:
            conflicts[vehicle.movement] = held_by_conflict(state, vehicle.movement)
        if not conflicts[vehicle.movement]:
            return True
        return vehicle.id in self._cleared and not can_stop(vehicle)

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

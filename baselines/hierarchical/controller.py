"""The paper's hierarchy: Go enters, under Stop a low level drives, and zones limit its speed."""

from collections.abc import Mapping, Sequence
from typing import Literal

from baselines.hierarchical.observation import SIDES, LateralObserver, Side, beside
from baselines.hierarchical.policy import LEFT, RIGHT, Forward, LowLevel, Random
from baselines.hierarchical.safety import with_braking
from baselines.wang.controller import Wang
from benchmark.controller import Command, Controller, Drive, Go
from benchmark.intersection import Intersection
from benchmark.learning.observation import Numbers
from benchmark.rules import can_stop, held_by_conflict
from benchmark.state import TrafficState, Vehicle


class Hierarchical(Controller):
    """Wang's Go/Stop on top; accelerations and lane changes under Stop; speed zones beneath.

    A Go that the arbitration would hold back counts as Stop.

    Args:
        top: who says Go: Wang's policy, or everybody always.
        low: who drives under Stop: a policy that only drives on, or a random one.
        lateral: whether RVs change lanes.
        zones: whether the safety mechanism limits speeds.
    """

    def __init__(
        self,
        *,
        top: Literal["wang", "go"] = "wang",
        low: Literal["forward", "random"] = "forward",
        lateral: bool = True,
        zones: bool = True,
    ) -> None:
        self._wang = Wang() if top == "wang" else None
        self._low, self._lateral, self._zones = low, lateral, zones
        self.weights_hash = self._wang.weights_hash if self._wang else None

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Look at another intersection."""
        if self._wang is not None:
            self._wang.reset(intersection, seed)
        self._intersection = intersection
        self._observer = LateralObserver(intersection)
        self._policy: LowLevel = Random(seed) if self._low == "random" else Forward()
        self._beside = beside(intersection)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Go for RVs that may enter, Drive for the other RVs in the decision zone."""
        entering = self._entering(state)
        stopped = [ego for ego in state.deciding if ego.id not in entering]
        going = [ego.id for ego in state.deciding if ego.id in entering]
        commands: dict[str, Command] = dict.fromkeys(going, Go())
        if stopped:
            actions = self._actions(state, stopped)
            for ego, action in zip(stopped, actions.tolist(), strict=True):
                commands[ego.id] = self._drive(ego, *action)
        return commands

    def _actions(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """The low level's actions (egos, 2) in [-1, 1]."""
        return self._policy(self._observer.observe(state, egos))

    def _entering(self, state: TrafficState) -> set[str]:
        """RVs that the top level lets go and no conflict holds back, or that cannot stop."""
        movements = {ego.movement for ego in state.deciding}
        held = {name: held_by_conflict(state, name) for name in movements}
        free = [ego for ego in state.deciding if not (held[ego.movement] and can_stop(ego))]
        return self._wang.going(state, free) if self._wang else {ego.id for ego in free}

    def _drive(self, ego: Vehicle, acceleration: float, lane_change: float) -> Drive:
        """The command of an action (paper, "Action Space").

        Args:
            ego: an RV under Stop.
            acceleration: -1 is its hardest braking, 1 its greatest acceleration.
            lane_change: below -0.33 to the left, above 0.33 to the right.
        """
        body, step = ego.body, self._intersection.step
        wanted = acceleration * (body.acceleration if acceleration > 0 else body.deceleration)
        if self._zones:
            wanted = with_braking(ego, wanted, step)
        return Drive(wanted, self._side(ego, lane_change) if self._lateral else 0)

    def _side(self, ego: Vehicle, lane_change: float) -> Side:
        """The lane change that is asked for, where the lane on that side serves the movement."""
        if LEFT <= lane_change <= RIGHT:
            return 0
        index = 0 if lane_change < LEFT else 1
        lane = self._beside.get(ego.lane, (None, None))[index]
        if lane is None or ego.movement not in self._intersection.lanes[lane].movements:
            return 0
        return SIDES[index]

"""The learning problem: RVs that come into the decision zone, decide every step, and leave it.

Plain Python and numpy; ``benchmark.learning.parallel`` and ``single`` show it as environments.
"""

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from benchmark.control.controller import Command, Go, Stop
from benchmark.control.intersection import Intersection
from benchmark.control.state import STATIONARY, TrafficState, Vehicle
from benchmark.learning.observation import Layout, Numbers, Observer
from benchmark.plumbing.errors import ScenarioError, UsageError
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import demand
from benchmark.sumo.junction import movement_of
from benchmark.world.gridlock import GRIDLOCK_AFTER, GridlockWatch
from benchmark.world.rules import Orders
from benchmark.world.world import World

STOP, GO = 0, 1
"""The actions."""


def checked(action: object, whose: str) -> int:
    """An action from outside as ``GO`` or ``STOP``: what ``Discrete(2)`` contains, no more.

    Raises:
        UsageError: it is neither.
    """
    if isinstance(action, np.ndarray) and action.shape == () and action.dtype.kind in "iu":
        action = action[()]  # Stable-Baselines3's ``predict`` gives such
    if isinstance(action, int | np.integer) and action in (STOP, GO):
        return int(action)
    raise UsageError(f"{whose}: action {action!r}; expected 0 for Stop or 1 for Go")


class Reward(BaseModel):
    """What a decision earns.

    Published is the mean waiting of the ego's own movement, normalised, positive for Go and
    negative for Stop, less a penalty for a Go that a conflict held back (Wang et al.). ``team``
    adds what all RVs share: minus the vehicles that stand in the control zone.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    own: float = Field(1.0, ge=0, description="weight of the own movement's waiting")
    longest_wait: float = Field(200.0, gt=0, description="waiting that counts as 1 [s]")
    penalty: float = Field(1.0, ge=0, description="for a Go that was held back")
    team: float = Field(0.0, ge=0, description="cost of a standing vehicle in the control zone")
    afterlife: int = Field(
        0, ge=0, description="steps after an RV entered whose team reward it still earns"
    )


class Decision(NamedTuple):
    """What followed for one RV from one action."""

    reward: float
    left: bool  # whether it has left the decision zone, into the intersection


@dataclass(frozen=True)
class Moment:
    """What RVs see at one step, and what became of those that decided a step ago."""

    time: float  # s
    egos: tuple[Vehicle, ...]  # the RVs that decide now
    observations: Numbers  # a row for each ego
    followed: Mapping[str, Decision]  # by id, those that decided a step ago
    team: float  # what every RV earned in this step
    over: bool  # whether the scenario has ended
    gridlocked: bool  # whether nobody has entered the intersection for long


class Traffic:
    """One scenario, rate and seed as a learning problem; a context manager.

    Args:
        scenario: an intersection with one junction, its lights dark.
        rate: the penetration rate.
        seed: of demand, drivers and RVs.
        layout: of the observation.
        reward: what decisions earn.
        arbitration: whether Go commands pass the flexible arbitration.
        gridlock_after: after how long it is one, as ``GridlockWatch`` says [s].

    Raises:
        UsageError: the rate is no share, or there is no such layout.
        RightOfWayError: the scenario cannot be run.
    """

    def __init__(
        self,
        scenario: Scenario,
        rate: float,
        seed: int,
        *,
        layout: Layout = "paper",
        reward: Reward | None = None,
        arbitration: Literal["flexible", "own"] = "flexible",
        gridlock_after: float = GRIDLOCK_AFTER,
    ) -> None:
        if not 0 <= rate <= 1:
            raise UsageError(f"rate {rate:g}: expected a share from 0 to 1")
        if scenario.intersection.driving_side == "left":
            raise ScenarioError(
                f'{scenario.name}: intersection.driving_side = "left": what training observes '
                "names left turns; expected traffic that drives on the right"
            )
        self.reward = reward or Reward()
        self.world = World(scenario, rate, seed, controller="training", arbitration=arbitration)
        if len(self.world.sites) != 1:
            raise ScenarioError(f"{scenario.name}: training needs a scenario with one junction")
        ((self._name, self._site),) = self.world.sites.items()
        self._observer = Observer(self.intersection, layout)
        self._gridlock = GridlockWatch(self.intersection, gridlock_after)

    @property
    def intersection(self) -> Intersection:
        """Where it happens."""
        return self._site.junction.intersection

    @property
    def deciders(self) -> tuple[str, ...]:
        """Ids of the RVs of the demand that will decide if they get through to the zone."""
        regulated = self.intersection.regulated_movements
        return tuple(
            name
            for name, traveller in self.world.routes.travellers.items()
            if demand.is_robot(self.world.seed, name, self.world.rate)
            and movement_of(self._site.junction, traveller.route) in regulated
        )

    @property
    def average_waiting_time(self) -> float | None:
        """The headline figure so far [s]; None while the warm-up lasts."""
        if self.state.time <= self.world.scenario.evaluation.warm_up:
            return None
        return self.world.junction_metrics()[self._name].average_waiting_time

    def __enter__(self) -> "Traffic":
        with contextlib.ExitStack() as opened:
            opened.enter_context(self.world)
            self.state = self.world.step()[self._name]
            opened.pop_all()  # all is well, so it stays open
        return self

    def __exit__(self, *error: object) -> None:
        self.world.__exit__(*error)

    def first(self) -> Moment:
        """The moment at which the episode begins; mostly nobody is there yet."""
        return self._moment({}, 0.0)

    def step(self, actions: Mapping[str, int]) -> Moment:
        """Let the RVs act and simulate one step.

        Args:
            actions: ``GO`` or ``STOP`` by id, for RVs that decide; one without drives by itself.

        Raises:
            KeyError: an id is not of an RV that decides.
        """
        before = self.state
        egos = {ego.id: ego for ego in before.deciding}
        movements = {name: egos[name].movement for name in actions}
        orders = self.advance(
            {name: Go() if action == GO else Stop() for name, action in actions.items()}
        )
        team = self._team()
        here = {ego.id for ego in self.state.deciding}
        followed = {
            name: Decision(
                reward=self._own(before, movements[name], action)
                - self.reward.penalty * (name in orders.held_back)
                + team,
                left=name not in here,
            )
            for name, action in actions.items()
        }
        return self._moment(followed, team)

    def advance(self, commands: Mapping[str, Command]) -> Orders:
        """Carry out any commands and simulate one step.

        Returns:
            What became of the commands; ``state`` is what is to be seen now.
        """
        orders = self._site.rules.decide(self.state, commands)
        self.world.carry_out(self._name, orders, self.state.time)
        self.state = self.world.step()[self._name]
        self._gridlock.see(self.state)
        return orders

    @property
    def gridlocked(self) -> bool:
        """Whether nobody has entered the intersection for long."""
        return self._gridlock.gridlocked

    def _own(self, state: TrafficState, movement: str, action: int) -> float:
        waiting = min(1.0, state.movements[movement].waiting / self.reward.longest_wait)
        return self.reward.own * waiting * (1 if action == GO else -1)

    def _team(self) -> float:
        if not self.reward.team:
            return 0.0
        standing = sum(vehicle.speed < STATIONARY for vehicle in self.state.vehicles)
        return -self.reward.team * standing

    def _moment(self, followed: Mapping[str, Decision], team: float) -> Moment:
        egos = self.state.deciding
        return Moment(
            time=self.state.time,
            egos=egos,
            observations=self._observer.observe(self.state, egos),
            followed=followed,
            team=team,
            over=self.world.over,
            gridlocked=self.gridlocked,
        )

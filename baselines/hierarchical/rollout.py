"""Episodes under the hierarchy with a low level that explores; what its learner learns from.

The unit of learning is the trajectory of a vehicle: its low-level decisions from the first to the
last, and what the team earned after each.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from baselines.hierarchical.controller import Hierarchical
from baselines.hierarchical.policy import Learned
from benchmark.controller import Command
from benchmark.learning.observation import Numbers
from benchmark.learning.traffic import Traffic
from benchmark.scenario import Scenario
from benchmark.state import STATIONARY, TrafficState, Vehicle


class Reward(BaseModel):
    """What every RV earns in a step; the published part is the first (paper, "Reward")."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    waiting: float = Field(1.0, ge=0, description="cost of the sum of normalised waiting")
    longest_wait: float = Field(200.0, gt=0, description="waiting that counts as 1 [s]")
    standing: float = Field(0.0, ge=0, description="cost of a standing vehicle")

    def of(self, state: TrafficState) -> float:
        """What the traffic in the control zone is worth now."""
        waiting = sum(min(1.0, one.waiting / self.longest_wait) for one in state.vehicles)
        standing = sum(one.speed < STATIONARY for one in state.vehicles)
        return -self.waiting * waiting - self.standing * standing


@dataclass(frozen=True)
class Rollout:
    """An episode to be played."""

    scenario: Scenario
    rate: float
    seed: int  # of the traffic and of exploration
    arrays: Mapping[str, Numbers]  # of the policy, with "spread" where it explores
    reward: Reward = field(default_factory=Reward)
    gridlock_after: float = 90.0  # s


@dataclass(frozen=True)
class Trajectory:
    """A trajectory of one vehicle; there are no rows of any other."""

    observations: Numbers  # (decisions, SIZE)
    actions: Numbers  # (decisions, 2), before clipping
    rewards: Numbers  # (decisions,)
    ended: bool  # whether it got out of the zone, not only the episode to its end


@dataclass(frozen=True)
class Played:
    """What an episode left."""

    trajectories: tuple[Trajectory, ...]  # in the order in which vehicles came
    average_waiting_time: float | None  # s
    gridlocked: bool


@dataclass
class _Path:
    """A trajectory that grows."""

    observations: list[Numbers] = field(default_factory=list)
    actions: list[Numbers] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)


class Exploring(Hierarchical):
    """The hierarchy with draws around the learned policy's means, which it notes.

    Args:
        arrays: of the policy, with ``spread`` (2,), or without it to take the means.
        seed: of the draws.
    """

    def __init__(self, arrays: Mapping[str, Numbers], seed: int) -> None:
        super().__init__(low="forward")
        self._mean = Learned({k: v for k, v in arrays.items() if k != "spread"})
        self._spread = arrays.get("spread")
        self._random = np.random.default_rng(seed)
        self.paths: dict[str, _Path] = {}
        self.acted: set[str] = set()  # ids of RVs that the low level drove in the last step

    def _actions(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        seen = self._observer.observe(state, egos)
        actions = self._mean.means(seen)
        if self._spread is not None:
            draws = self._random.standard_normal(actions.shape).astype(np.float32)
            actions = actions + self._spread * draws
        for ego, row, action in zip(egos, seen, actions, strict=True):
            path = self.paths.setdefault(ego.id, _Path())
            path.observations.append(row)
            path.actions.append(action)
            path.rewards.append(0.0)
        self.acted = {ego.id for ego in egos}
        return np.clip(actions, -1.0, 1.0)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """As the hierarchy does."""
        self.acted = set()
        return super().act(state)


def play(rollout: Rollout) -> Played:
    """Play an episode; equal arguments give equal trajectories."""
    controller = Exploring(rollout.arrays, rollout.seed)
    with Traffic(
        rollout.scenario, rollout.rate, rollout.seed, gridlock_after=rollout.gridlock_after
    ) as traffic:
        controller.reset(traffic.intersection, rollout.seed)
        while not (traffic.world.over or traffic.gridlocked):
            traffic.advance(controller.act(traffic.state))
            earned = rollout.reward.of(traffic.state)
            here = {ego.id for ego in traffic.state.deciding}
            for name in (here | controller.acted) & controller.paths.keys():
                controller.paths[name].rewards[-1] += earned
        here = {ego.id for ego in traffic.state.deciding}
        waiting, jammed = traffic.average_waiting_time, traffic.gridlocked
    return Played(
        tuple(
            Trajectory(
                np.stack(path.observations),
                np.stack(path.actions),
                np.asarray(path.rewards, dtype=np.float32),
                ended=name not in here,
            )
            for name, path in controller.paths.items()
        ),
        waiting,
        jammed,
    )

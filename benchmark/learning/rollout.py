"""Episodes under a policy, played in worker processes; what learners learn from.

The unit of learning is a vehicle's trajectory: from its first decision to the last, nothing of any
other vehicle in it and no padding.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from benchmark.learning.observation import Layout, Numbers
from benchmark.learning.traffic import Moment, Reward, Traffic
from benchmark.plumbing.processes import end, pool
from benchmark.scenario.scenario import Scenario
from benchmark.world.gridlock import GRIDLOCK_AFTER

Actions = npt.NDArray[np.int64]

Policy = Callable[[Numbers], Actions]
"""Observations, a row for each RV, to an action for each; pickled into workers."""


@dataclass(frozen=True)
class Rollout:
    """An episode to be played."""

    scenario: Scenario
    rate: float
    seed: int  # of the traffic
    layout: Layout = "paper"
    reward: Reward = field(default_factory=Reward)
    exploration: float = 0.0  # probability of a random action
    discount: float = 0.99  # of what an RV earns after it entered
    gridlock_after: float | None = GRIDLOCK_AFTER  # s; None plays gridlocked episodes to their end


@dataclass(frozen=True)
class Trajectory:
    """All decisions of one vehicle, in order."""

    observations: Numbers  # (decisions, size); those of ``play`` have one more: what came after
    actions: npt.NDArray[Any]  # (decisions,), or (decisions, n) where an action is n numbers
    rewards: Numbers  # (decisions,)
    ended: bool  # by itself, as the RV entered; else the episode ended first and the value goes on


@dataclass(frozen=True)
class Played:
    """What came of an episode."""

    trajectories: tuple[Trajectory, ...]  # in the order in which vehicles came
    average_waiting_time: float | None  # s; as far as the episode went, None within its warm-up
    steps: int
    gridlocked: bool


def play(rollout: Rollout, policy: Policy) -> Played:
    """Play an episode.

    Draws of exploration come from the traffic's seed, so equal arguments give equal trajectories.
    """
    random = np.random.default_rng(rollout.seed)
    paths: dict[str, _Path] = {}
    team: list[float] = []
    traffic = Traffic(
        rollout.scenario,
        rollout.rate,
        rollout.seed,
        layout=rollout.layout,
        reward=rollout.reward,
        gridlock_after=rollout.gridlock_after or float("inf"),
    )
    with traffic:
        moment = traffic.first()
        while not (moment.over or moment.gridlocked):
            actions = _act(moment, policy, rollout.exploration, random)
            for ego, seen, action in zip(moment.egos, moment.observations, actions, strict=True):
                path = paths.setdefault(ego.id, _Path())
                path.observations.append(seen)
                path.actions.append(int(action))
            chosen = {ego.id: int(a) for ego, a in zip(moment.egos, actions, strict=True)}
            moment = traffic.step(chosen)
            team.append(moment.team)
            for name, decision in moment.followed.items():
                paths[name].rewards.append(decision.reward)
                if decision.left:
                    paths[name].entered_at = len(team)
        afterwards = {
            ego.id: seen for ego, seen in zip(moment.egos, moment.observations, strict=True)
        }
        waiting = traffic.average_waiting_time
    return Played(
        trajectories=tuple(
            path.trajectory(afterwards.get(name), team, rollout)
            for name, path in paths.items()
            if path.actions
        ),
        average_waiting_time=waiting,
        steps=len(team),
        gridlocked=moment.gridlocked,
    )


def _act(
    moment: Moment, policy: Policy, exploration: float, random: np.random.Generator
) -> Actions:
    count = len(moment.egos)
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    if exploration >= 1.0:
        return random.integers(0, 2, count)
    actions = policy(moment.observations)
    if exploration > 0.0:
        explore = random.random(count) < exploration
        actions = np.where(explore, random.integers(0, 2, count), actions)
    return actions


@dataclass
class _Path:
    """A trajectory that grows."""

    observations: list[Numbers] = field(default_factory=list)
    actions: list[int] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    entered_at: int | None = None  # step

    def trajectory(
        self, afterwards: Numbers | None, team: Sequence[float], rollout: Rollout
    ) -> Trajectory:
        """The trajectory as arrays, with what the vehicle earns after it entered."""
        rewards = np.asarray(self.rewards, dtype=np.float32)
        if self.entered_at is not None:
            later = team[self.entered_at : self.entered_at + rollout.reward.afterlife]
            rewards[-1] += sum(r * rollout.discount**k for k, r in enumerate(later, start=1))
        last = np.zeros_like(self.observations[0]) if afterwards is None else afterwards
        return Trajectory(
            observations=np.stack([*self.observations, last]),
            actions=np.asarray(self.actions, dtype=np.int64),
            rewards=rewards,
            ended=self.entered_at is not None,
        )


class Workers:
    """Processes that play rollouts; a context manager.

    Args:
        count: how many.
    """

    def __init__(self, count: int) -> None:
        self._pool = pool(count)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        end(self._pool)  # what is still being played is of no use

    def play(self, rollouts: Sequence[Rollout], policy: Policy) -> list[Future[Played]]:
        """Start rollouts; the results come in their order."""
        return [self._pool.schedule(play, args=(rollout, policy)) for rollout in rollouts]

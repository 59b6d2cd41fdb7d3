"""Episodes under a hierarchy with a low level that explores; what its learner learns from.

The unit of learning is the trajectory of a vehicle: its low-level decisions from the first to the
last, and what it earned after each.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from baselines.hierarchical.controller import Hierarchical
from baselines.hierarchical.hierarchy import Hierarchy
from baselines.hierarchical.policy import ActionNetwork, LowLevelObserver
from baselines.hierarchical.reward import DrivingReward, Earnings
from baselines.hierarchical.tuned import HierarchicalTuned
from benchmark.control.state import TrafficState, Vehicle
from benchmark.learning.observation import Numbers
from benchmark.learning.rollout import Played, Trajectory
from benchmark.learning.traffic import Traffic
from benchmark.scenario.scenario import Scenario
from benchmark.world.gridlock import GRIDLOCK_AFTER

KINDS: Mapping[str, type[Hierarchy]] = {
    kind.NAME: kind for kind in (Hierarchical, HierarchicalTuned)
}


@dataclass(frozen=True)
class Exercise:
    """An episode in which a low level is trained or validated."""

    name: str  # of the hierarchy, a key of KINDS
    scenario: Scenario
    rate: float
    seed: int  # of the traffic and of exploration
    arrays: Mapping[str, Numbers]  # of the policy, with "spread" where it explores
    reward: DrivingReward = field(default_factory=DrivingReward)
    gridlock_after: float = GRIDLOCK_AFTER  # s


@dataclass
class _Path:
    """A trajectory that grows."""

    observations: list[Numbers] = field(default_factory=list)
    actions: list[Numbers] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)


class Explorer:
    """A low level that draws around a policy's means and notes what it saw and did.

    Args:
        arrays: of the policy, with ``spread`` (2,), or without it to take the means.
        observer: of what it sees.
        seed: of the draws.
    """

    def __init__(
        self, arrays: Mapping[str, Numbers], observer: LowLevelObserver, seed: int
    ) -> None:
        self._network, self._observer = ActionNetwork(arrays), observer
        self._spread = arrays.get("spread")
        self._random = np.random.default_rng(seed)
        self.paths: dict[str, _Path] = {}
        self.acted: frozenset[str] = frozenset()  # ids of the RVs that it drove last

    def __call__(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """Actions (egos, 2), clipped to [-1, 1]."""
        seen = self._observer.observe(state, egos)
        actions = self._network.means(seen)
        if self._spread is not None:
            draws = self._random.standard_normal(actions.shape).astype(np.float32)
            actions = actions + self._spread * draws
        for ego, row, action in zip(egos, seen, actions, strict=True):
            path = self.paths.setdefault(ego.id, _Path())
            path.observations.append(row)
            path.actions.append(action)
            path.rewards.append(0.0)
        self.acted = frozenset(ego.id for ego in egos)
        return np.clip(actions, -1.0, 1.0)

    def earn(self, earned: Mapping[str, float], otherwise: float) -> None:
        """Pay for the last decisions of RVs that are there, and of those that acted just now.

        Args:
            earned: by id, of RVs that are there.
            otherwise: what an RV earns that has just got out.
        """
        for name in earned.keys() | self.acted:
            if name in self.paths:
                self.paths[name].rewards[-1] += earned.get(name, otherwise)
        self.acted = frozenset()


def play(exercise: Exercise) -> Played:
    """Play an episode; equal arguments give equal trajectories."""
    controller = KINDS[exercise.name](low="forward")
    with Traffic(
        exercise.scenario,
        exercise.rate,
        exercise.seed,
        arbitration=controller.arbitration,
        gridlock_after=exercise.gridlock_after,
    ) as traffic:
        controller.reset(traffic.intersection, exercise.seed)
        explorer = Explorer(exercise.arrays, controller.observer, exercise.seed)
        controller.low_level = explorer
        earnings = Earnings(exercise.reward)
        steps = 0
        while not (traffic.world.over or traffic.gridlocked):
            steps += 1
            traffic.advance(controller.act(traffic.state))
            there = list(controller.concerned(traffic.state))
            explorer.earn(*earnings.of(traffic.state, there))
        here = {ego.id for ego in controller.concerned(traffic.state)}
        waiting, jammed = traffic.average_waiting_time, traffic.gridlocked
    return Played(
        trajectories=tuple(
            Trajectory(
                np.stack(path.observations),
                np.stack(path.actions),
                np.asarray(path.rewards, dtype=np.float32),
                ended=name not in here,
            )
            for name, path in explorer.paths.items()
        ),
        average_waiting_time=waiting,
        steps=steps,
        gridlocked=jammed,
    )

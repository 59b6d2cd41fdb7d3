"""The low level's learner: Stable-Baselines3's PPO over whole trajectories of vehicles."""

from collections.abc import Iterator, Sequence

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.type_aliases import RolloutBufferSamples

from benchmark.learning.observation import Numbers
from benchmark.learning.rollout import Trajectory

Arrays = dict[str, Numbers]


class Batch:
    """A round's trajectories as PPO reads them: rows of decisions, none of an absent vehicle.

    Args:
        model: whose values and log probabilities are taken.
        trajectories: of the round.
        discount: of a step.
        decay: lambda of generalised advantage estimation (Schulman et al., 2016).
        random: shuffles the rows.
    """

    def __init__(
        self,
        model: PPO,
        trajectories: Sequence[Trajectory],
        discount: float,
        decay: float,
        random: np.random.Generator,
    ) -> None:
        self._observations = torch.from_numpy(
            np.concatenate([t.observations for t in trajectories])
        )
        self._actions = torch.from_numpy(np.concatenate([t.actions for t in trajectories]))
        with torch.no_grad():
            values, chances, _ = model.policy.evaluate_actions(self._observations, self._actions)
        self.values: Numbers = values.flatten().numpy()
        self._chances = chances
        ends = np.cumsum([len(t.rewards) for t in trajectories])
        parts = np.split(self.values, ends[:-1])
        self._advantages = np.concatenate(
            [
                advantages(trajectory, part, discount, decay)
                for trajectory, part in zip(trajectories, parts, strict=True)
            ]
        )
        self.returns = self._advantages + self.values
        self._random = random

    def get(self, batch_size: int) -> Iterator[RolloutBufferSamples]:
        """Minibatches of all rows, shuffled."""
        order = self._random.permutation(len(self.values))
        for start in range(0, len(order), batch_size):
            rows = order[start : start + batch_size]
            if len(rows) > 1:  # PPO divides by the spread of advantages
                yield RolloutBufferSamples(
                    self._observations[rows],
                    self._actions[rows],
                    torch.from_numpy(self.values[rows]),
                    self._chances[rows],
                    torch.from_numpy(self._advantages[rows]),
                    torch.from_numpy(self.returns[rows]),
                )


def advantages(trajectory: Trajectory, values: Numbers, discount: float, decay: float) -> Numbers:
    """Generalised advantage estimates (decisions,) of one trajectory.

    After the last decision of a vehicle that got out nothing follows; where the episode was cut
    off, what would have followed is taken to be worth what the last decision was.

    Args:
        trajectory: of one vehicle.
        values: estimated, (decisions,).
        discount: of a step.
        decay: lambda.
    """
    following = np.append(values[1:], 0.0 if trajectory.ended else values[-1])
    surprise = trajectory.rewards + discount * following - values
    estimates = np.zeros_like(values)
    ahead = 0.0
    for index in reversed(range(len(estimates))):
        ahead = surprise[index] + discount * decay * ahead
        estimates[index] = ahead
    return estimates


def arrays(model: PPO) -> Arrays:
    """The policy as ``baselines.hierarchical.policy.ActionNetwork`` reads it."""
    state = model.policy.state_dict()
    plain = {name: tensor.detach().numpy().copy() for name, tensor in state.items()}
    policy: Arrays = {}
    layers = sorted(name for name in plain if name.startswith("mlp_extractor.policy_net"))
    for name in layers:
        place, kind = name.rsplit(".", 2)[1:]
        policy[f"hidden.{int(place) // 2}.{kind}"] = plain[name]
    return policy | {f"action.{kind}": plain[f"action_net.{kind}"] for kind in ("weight", "bias")}


def spread(model: PPO) -> Numbers:
    """The standard deviations with which the policy explores (2,)."""
    deviations: Numbers = np.exp(model.policy.state_dict()["log_std"].detach().numpy())
    return deviations

"""Wang's learner: Stable-Baselines3's DQN, dueling, double, distributional and by priority.

Its replay is filled with whole trajectories of vehicles.
"""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.utils import polyak_update
from stable_baselines3.dqn.policies import DQNPolicy, QNetwork
from torch import nn
from torch.nn import functional

from benchmark.learning.rollout import Trajectory


class DuelingNetwork(QNetwork):
    """State value and advantages over a shared trunk (Wang et al., 2016; Bellemare et al., 2017).

    Args:
        atoms: of the distribution of returns; 1 learns their mean.
        value_range: of the atoms.
        arguments: of ``QNetwork``.
    """

    support: torch.Tensor  # the atoms

    def __init__(self, *, atoms: int, value_range: tuple[float, float], **arguments: Any) -> None:
        super().__init__(**arguments)
        del self.q_net  # the plain head that QNetwork makes
        self.atoms = atoms
        widths = [self.features_dim, *self.net_arch]
        self.trunk = nn.ModuleList(nn.Linear(before, after) for before, after in pairwise(widths))
        self.value = nn.Linear(widths[-1], atoms)
        self.advantage = nn.Linear(widths[-1], int(self.action_space.n) * atoms)
        self.register_buffer("support", torch.linspace(*value_range, atoms), persistent=atoms > 1)

    def logits(self, observations: torch.Tensor) -> torch.Tensor:
        """Unnormalised log chances of the atoms, or values: (rows, actions, atoms)."""
        hidden = self.extract_features(observations, self.features_extractor)
        for layer in self.trunk:
            hidden = torch.relu(layer(hidden))
        advantage = self.advantage(hidden).unflatten(1, (-1, self.atoms))
        centred = advantage - advantage.mean(dim=1, keepdim=True)
        logits: torch.Tensor = centred + self.value(hidden).unsqueeze(1)
        return logits

    def forward(self, obs: torch.Tensor) -> torch.Tensor:  # type: ignore[override]
        """Expected returns: (rows, actions)."""
        logits = self.logits(obs)
        if self.atoms == 1:
            return logits.squeeze(2)
        return (logits.softmax(dim=2) * self.support).sum(dim=2)


class DuelingPolicy(DQNPolicy):
    """``DQNPolicy`` over a ``DuelingNetwork``."""

    def __init__(
        self, *arguments: Any, atoms: int = 1, value_range: tuple[float, float], **others: Any
    ) -> None:
        self._atoms, self._value_range = atoms, value_range
        super().__init__(*arguments, **others)

    def make_q_net(self) -> DuelingNetwork:
        """The network, online or target."""
        arguments = self._update_features_extractor(self.net_args, features_extractor=None)
        network = DuelingNetwork(atoms=self._atoms, value_range=self._value_range, **arguments)
        return network.to(self.device)


class PrioritisedSamples(NamedTuple):
    """A minibatch; weights undo the bias of sampling by priority."""

    observations: torch.Tensor
    actions: torch.Tensor
    next_observations: torch.Tensor
    discounts: torch.Tensor  # of what follows, (rows, 1); 0 where the trajectory ends
    rewards: torch.Tensor
    weights: torch.Tensor  # (rows, 1)
    rows: npt.NDArray[np.int64]  # of the buffer


class PrioritisedReplay(ReplayBuffer):
    """Replay by priority, proportional variant (Schaul et al., 2016).

    Args:
        alpha: how much priorities count; 0 samples uniformly.
        beta: how much of the sampling's bias the weights undo.
        discount: of a step.
        reach: steps whose rewards are summed before the value of what follows (n-step returns).
        random: draws the samples.
        arguments: of ``ReplayBuffer``.
    """

    def __init__(
        self,
        *arguments: Any,
        alpha: float,
        beta: float,
        discount: float,
        reach: int = 1,
        random: np.random.Generator,
        **others: Any,
    ) -> None:
        others["handle_timeout_termination"] = False  # dones say who entered
        super().__init__(*arguments, **others)
        self._alpha, self._beta, self.random = alpha, beta, random
        self._discount, self._reach = discount, reach
        self.priorities = np.zeros(self.buffer_size)
        self.discounts = np.zeros(self.buffer_size, dtype=np.float32)

    def extend(self, trajectory: Trajectory) -> None:
        """Add a vehicle's decisions; new ones get the highest priority there is."""
        count = len(trajectory.actions)
        rows = (self.pos + np.arange(count)) % self.buffer_size
        ahead = np.minimum(np.arange(count) + self._reach, count)
        later = np.concatenate([trajectory.rewards, np.zeros(self._reach, dtype=np.float32)])
        windows = np.lib.stride_tricks.sliding_window_view(later, self._reach)[:count]
        self.observations[rows, 0] = trajectory.observations[:-1]
        self.next_observations[rows, 0] = trajectory.observations[ahead]
        self.actions[rows, 0, 0] = trajectory.actions
        self.rewards[rows, 0] = windows @ self._discount ** np.arange(self._reach)
        self.dones[rows, 0] = trajectory.ended & (ahead == count)
        self.discounts[rows] = self._discount ** (ahead - np.arange(count))
        self.priorities[rows] = self.priorities.max(initial=0.0) or 1.0
        self.full = self.full or self.pos + count >= self.buffer_size
        self.pos = (self.pos + count) % self.buffer_size

    def sample(self, batch_size: int, env: object = None) -> PrioritisedSamples:  # type: ignore[override]
        """A minibatch, drawn by priority."""
        size = self.size()
        heights = np.cumsum(self.priorities[:size] ** self._alpha)
        places = (np.arange(batch_size) + self.random.random(batch_size)) / batch_size
        rows = np.minimum(np.searchsorted(heights, places * heights[-1]), size - 1)
        chances = self.priorities[rows] ** self._alpha / heights[-1]
        weights = (size * chances) ** -self._beta
        return PrioritisedSamples(
            torch.from_numpy(self.observations[rows, 0]),
            torch.from_numpy(self.actions[rows, 0]),
            torch.from_numpy(self.next_observations[rows, 0]),
            torch.from_numpy(self.discounts[rows, None] * (1 - self.dones[rows])),
            torch.from_numpy(self.rewards[rows]),
            torch.from_numpy((weights / weights.max()).astype(np.float32)[:, None]),
            rows,
        )

    def update(self, rows: npt.NDArray[np.int64], errors: npt.NDArray[np.float32]) -> None:
        """Set the priorities of rows to their errors."""
        self.priorities[rows] = np.abs(errors) + 1e-6


class WangDQN(DQN):
    """Stable-Baselines3's DQN; ``train`` with double and distributional targets by priority."""

    policy: DuelingPolicy
    q_net: DuelingNetwork
    q_net_target: DuelingNetwork
    replay_buffer: PrioritisedReplay

    def train(self, gradient_steps: int, batch_size: int = 128) -> None:
        """Take gradient steps; the target network follows every ``target_update_interval``."""
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        losses = []
        for _ in range(gradient_steps):
            batch = self.replay_buffer.sample(batch_size)
            errors = self._errors(batch)
            loss = (batch.weights.squeeze(1) * errors).mean()
            losses.append(loss.item())
            self.policy.optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
            self.policy.optimizer.step()
            self.replay_buffer.update(batch.rows, errors.detach().numpy())
            self._n_updates += 1
            if self._n_updates % self.target_update_interval == 0:
                polyak_update(self.q_net.parameters(), self.q_net_target.parameters(), self.tau)
        self.logger.record("train/updates", self._n_updates)
        if losses:
            self.logger.record("train/loss", float(np.mean(losses)))

    def _errors(self, batch: PrioritisedSamples) -> torch.Tensor:
        """The loss of each row: Huber of the temporal difference, or cross-entropy."""
        chosen = batch.actions.long()
        logits = self.q_net.logits(batch.observations)
        taken = logits.gather(1, chosen.unsqueeze(2).expand(-1, 1, self.q_net.atoms)).squeeze(1)
        with torch.no_grad():
            best = self.q_net(batch.next_observations).argmax(dim=1)
            following = self.q_net_target.logits(batch.next_observations)
            following = following[torch.arange(len(best)), best]
            if self.q_net.atoms == 1:
                target = batch.rewards + batch.discounts * following
            else:
                chances = following.softmax(dim=1)
                target = project(chances, batch.rewards, batch.discounts, self.q_net.support)
        if self.q_net.atoms == 1:
            return functional.smooth_l1_loss(taken, target, reduction="none").squeeze(1)
        return -(target * taken.log_softmax(dim=1)).sum(dim=1)


def project(
    chances: torch.Tensor, rewards: torch.Tensor, discounts: torch.Tensor, support: torch.Tensor
) -> torch.Tensor:
    """The distribution of reward plus discounted return, on the same atoms.

    Bellemare et al., 2017, algorithm 1.

    Args:
        chances: of the next state's atoms, (rows, atoms).
        rewards: (rows, 1).
        discounts: (rows, 1); 0 where the trajectory ends.
        support: the atoms, evenly spaced, (atoms,).
    """
    low, high = support[0], support[-1]
    gap = (high - low) / (len(support) - 1)
    places = ((rewards + discounts * support).clamp(low, high) - low) / gap
    left = places.floor().clamp(max=len(support) - 2)
    share = places - left
    projected = torch.zeros_like(chances)
    projected.scatter_add_(1, left.long(), chances * (1 - share))
    return projected.scatter_add_(1, left.long() + 1, chances * share)

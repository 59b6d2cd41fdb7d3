"""Trains the low level by PPO: ``rightofway train hierarchical``.

A round is played with the weights that learn from it.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from pydantic import Field, PositiveInt
from stable_baselines3 import PPO

from baselines.hierarchical import ppo
from baselines.hierarchical.reward import DrivingReward
from baselines.hierarchical.rollout import KINDS, Exercise, play
from benchmark.learning.rollout import Played
from benchmark.learning.rounds import LearnerSettings, Rounds, RunSettings, SpacesOnly
from benchmark.learning.run import Start
from benchmark.learning.settings import Options
from benchmark.learning.weights import Arrays
from benchmark.world.gridlock import GRIDLOCK_AFTER


class PPOSettings(LearnerSettings):
    """PPO over trajectories of vehicles (paper, "Low-level Longitudinal and Lateral Control")."""

    hidden: tuple[PositiveInt, ...] = Field((64, 64), min_length=1, description="widths")
    discount: float = Field(0.99, ge=0, lt=1)
    decay: float = Field(0.95, ge=0, le=1, description="lambda of the advantages")
    learning_rate: float = Field(3e-4, gt=0)
    clip: float = Field(0.3, gt=0, description="epsilon of the policy loss")
    epochs: int = Field(4, gt=0)
    batch: int = Field(1024, gt=1)
    entropy: float = Field(0.0, ge=0, description="weight of the entropy bonus")
    spread: float = Field(0.6, gt=0, description="standard deviation of actions at first")
    forward: float = Field(0.0, description="mean acceleration at first, 1 is the greatest")


class HierarchicalSettings(RunSettings):
    """All settings of a run; ``hierarchical.toml`` holds the shipped ones."""

    reward: DrivingReward = DrivingReward()
    learner: PPOSettings


def train_hierarchical(options: Options) -> None:
    """Train the low level as published."""
    _train("hierarchical", options)


def train_tuned(options: Options) -> None:
    """Train the low level under time windows."""
    _train("hierarchical-tuned", options)


def _train(name: str, options: Options) -> None:
    LowLevelLearning(name, Path(__file__).with_name(f"{name}.toml"), options).run()


class LowLevelLearning(Rounds[HierarchicalSettings, PPO]):
    """A run of PPO."""

    kind = HierarchicalSettings
    ahead = False

    def _new(self, seed: int) -> PPO:
        return _model(self.settings.learner, KINDS[self.name].SIZE, seed)

    def _snapshot(self) -> Arrays:
        return ppo.arrays(self.model)

    def _episode(self, start: Start, acting: Arrays, *, learns: bool) -> Callable[[], Played]:
        """The mean actions in a validation, draws around them otherwise."""
        limit = GRIDLOCK_AFTER
        if learns:
            acting = {**acting, "spread": ppo.spread(self.model)}
            limit = self.settings.traffic.gridlock_after
        return partial(play, Exercise(self.name, *start, acting, self.settings.reward, limit))

    def _learn(self, played: Sequence[Played], before: int) -> Mapping[str, float]:
        """Take PPO's epochs on a round."""
        trajectories = [path for episode in played for path in episode.trajectories]
        learner = self.settings.learner
        random = np.random.default_rng([self._options.seed, self.course.round - 1, 1])
        self.model.rollout_buffer = ppo.Batch(  # type: ignore[assignment]
            self.model, trajectories, learner.discount, learner.decay, random
        )
        self.model.train()
        actions = np.concatenate([path.actions for path in trajectories])
        return {
            "reward": fmean(float(path.rewards.mean()) for path in trajectories),
            "acceleration": float(actions[:, 0].mean()),
            "lane_changes": float((np.abs(actions[:, 1]) > 0.33).mean()),
        }

    def _notes(self) -> Mapping[str, Any]:
        return {"hidden": self.settings.learner.hidden}


def _model(learner: PPOSettings, size: int, seed: int) -> PPO:
    model = PPO(
        "MlpPolicy",
        SpacesOnly(size, spaces.Box(-1.0, 1.0, (2,), np.float32)),
        learning_rate=learner.learning_rate,
        n_steps=learner.batch,
        batch_size=learner.batch,
        n_epochs=learner.epochs,
        gamma=learner.discount,
        gae_lambda=learner.decay,
        clip_range=learner.clip,
        ent_coef=learner.entropy,
        vf_coef=1.0,  # policy and value loss count alike (paper, eq. of the loss)
        policy_kwargs={
            "net_arch": list(learner.hidden),
            "log_std_init": float(np.log(learner.spread)),
        },
        seed=seed,
        device="cpu",
    )
    with torch.no_grad():
        bias = model.policy.action_net.bias
        assert isinstance(bias, torch.Tensor)
        bias.copy_(torch.tensor([learner.forward, 0.0]))
    return model

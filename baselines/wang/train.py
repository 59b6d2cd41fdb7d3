"""Trains Wang's controller by deep Q-learning: ``rightofway train wang``.

The workers play round k + 1 with the weights of round k - 1 while the learner takes its steps on
round k.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from pydantic import Field, PositiveInt, field_validator

from baselines.wang.dqn import DuelingPolicy, PrioritisedReplay, WangDQN
from baselines.wang.policy import HIDDEN, Greedy, shapes
from benchmark.learning.observation import Layout, size
from benchmark.learning.rollout import Played, Rollout, play
from benchmark.learning.rounds import LearnerSettings, Rounds, RunSettings, SpacesOnly
from benchmark.learning.run import Start
from benchmark.learning.settings import Options
from benchmark.learning.traffic import Reward
from benchmark.learning.weights import Arrays

REPLAYED = (
    "observations",
    "next_observations",
    "actions",
    "rewards",
    "dones",
    "discounts",
    "priorities",
)
"""What a checkpoint holds of the replay."""


class QLearningSettings(LearnerSettings):
    """Deep Q-learning with the published ingredients (Wang et al.)."""

    hidden: tuple[PositiveInt, ...] = Field(
        HIDDEN, min_length=1, description="widths of the hidden layers"
    )
    atoms: int = Field(51, gt=0, description="of the distribution of returns; 1 learns the mean")
    value_range: tuple[float, float] = (-10.0, 10.0)
    discount: float = Field(0.99, ge=0, lt=1)
    reach: int = Field(1, gt=0, description="steps of n-step returns")
    learning_rate: float = Field(1e-4, gt=0)
    batch: int = Field(128, gt=0)
    decisions_per_update: int = Field(64, gt=0)
    target_every: int = Field(500, gt=0, description="updates between copies to the target")
    buffer: int = Field(50_000, gt=0)
    alpha: float = Field(0.5, ge=0, description="how much priorities count in sampling")
    beta: float = Field(0.4, ge=0, description="how much of its bias is undone")
    exploration: float = Field(0.05, ge=0, le=1, description="chance of a random action, at last")
    exploring: float = Field(0.2, gt=0, le=1, description="share of the steps until then")

    @field_validator("value_range")
    @classmethod
    def _rises(cls, bounds: tuple[float, float]) -> tuple[float, float]:
        if bounds[0] >= bounds[1]:
            raise ValueError(f"expected the lower bound first; got {bounds}")
        return bounds


class WangSettings(RunSettings):
    """All settings of a run; ``wang.toml`` and ``wang-tuned.toml`` hold the shipped ones."""

    layout: Layout = "paper"
    reward: Reward = Reward()
    learner: QLearningSettings


def train_wang(options: Options) -> None:
    """Train ``wang``."""
    _train("wang", options)


def train_tuned(options: Options) -> None:
    """Train ``wang-tuned``."""
    _train("wang-tuned", options)


def _train(name: str, options: Options) -> None:
    QLearning(name, Path(__file__).with_name(f"{name}.toml"), options).run()


class QLearning(Rounds[WangSettings, WangDQN]):
    """A run of deep Q-learning."""

    kind = WangSettings
    ahead = True

    def _new(self, seed: int) -> WangDQN:
        learner = self.settings.learner
        model = WangDQN(
            DuelingPolicy,
            SpacesOnly(size(self.settings.layout), spaces.Discrete(2)),
            learning_rate=learner.learning_rate,
            buffer_size=learner.buffer,
            gamma=learner.discount,
            target_update_interval=learner.target_every,
            replay_buffer_class=PrioritisedReplay,
            replay_buffer_kwargs={
                "alpha": learner.alpha,
                "beta": learner.beta,
                "discount": learner.discount,
                "reach": learner.reach,
                "random": np.random.default_rng(seed),
            },
            policy_kwargs={
                "net_arch": list(learner.hidden),
                "atoms": learner.atoms,
                "value_range": learner.value_range,
            },
            seed=seed,
            device="cpu",
        )
        model.tau = 1.0
        return model

    def _snapshot(self) -> Arrays:
        state = self.model.q_net.state_dict()
        return {name: tensor.detach().numpy().copy() for name, tensor in state.items()}

    def _episode(self, start: Start, acting: Arrays, *, learns: bool) -> Callable[[], Played]:
        settings = self.settings
        rollout = Rollout(*start, settings.layout, settings.reward)
        if learns:
            rollout = replace(
                rollout,
                exploration=self._exploration(),
                discount=settings.learner.discount,
                gridlock_after=settings.traffic.gridlock_after,
            )
        return partial(play, rollout, Greedy(acting))

    def _exploration(self) -> float:
        learner = self.settings.learner
        done = min(1.0, self.course.decisions / (learner.exploring * learner.steps))
        return 1.0 + done * (learner.exploration - 1.0)

    def _learn(self, played: Sequence[Played], before: int) -> Mapping[str, float]:
        """Fill the replay and take the steps that are due."""
        learner, decisions = self.settings.learner, self.course.decisions
        trajectories = [path for episode in played for path in episode.trajectories]
        for trajectory in trajectories:
            self.model.replay_buffer.extend(trajectory)
        due = learner.decisions_per_update
        if self.model.replay_buffer.size() >= learner.batch:
            self.model.train(decisions // due - before // due, learner.batch)
        rewards = sum(float(path.rewards.sum()) for path in trajectories)
        return {
            "reward": rewards / (decisions - before),
            "go": fmean(float(path.actions.mean()) for path in trajectories),
            "exploration": self._exploration(),
        }

    def _kept(self) -> Mapping[str, Any]:
        replay = self.model.replay_buffer
        rows = replay.size()
        return {
            "replay": {name: torch.from_numpy(getattr(replay, name)[:rows]) for name in REPLAYED},
            "place": (replay.pos, replay.full),
            "random": json.dumps(replay.random.bit_generator.state),
        }

    def _resume(self, content: Mapping[str, Any]) -> None:
        replay = self.model.replay_buffer
        for name, rows in content["replay"].items():
            getattr(replay, name)[: len(rows)] = rows.numpy()
        replay.pos, replay.full = content["place"]
        replay.random.bit_generator.state = json.loads(content["random"])

    def _notes(self) -> Mapping[str, Any]:
        settings, learner = self.settings, self.settings.learner
        assert self.course.best is not None
        expected = shapes(settings.layout, learner.hidden, learner.atoms)
        kept = {name: array.shape for name, array in self.course.best.arrays.items()}
        assert kept == expected
        return {"layout": settings.layout, "hidden": learner.hidden, "atoms": learner.atoms}

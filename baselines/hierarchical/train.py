"""Trains the low level: rounds of episodes in worker processes, then PPO's epochs on all of them.

A round is played with the weights that learn from it, so equal seeds give equal weights however
many workers there are.
"""

from collections.abc import Iterable, Sequence
from concurrent.futures import Future
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING

import numpy as np
import torch
from pydantic import Field, PositiveInt
from stable_baselines3 import PPO

from baselines.hierarchical import ppo
from baselines.hierarchical.reward import Reward
from baselines.hierarchical.rollout import KINDS, Played, Rollout, play
from benchmark.learning.course import Course
from benchmark.learning.run import (
    Folder,
    Interrupts,
    Options,
    Start,
    TrainingTraffic,
    Validation,
    read_settings,
    training_episodes,
    validation_episodes,
)
from benchmark.learning.traffic import GRIDLOCK_AFTER
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.models import Table
from benchmark.plumbing.processes import result_of, working
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario

if TYPE_CHECKING:
    from pebble import ProcessPool


class LearnerSettings(Table):
    """PPO over trajectories of vehicles (paper, "Low-level Longitudinal and Lateral Control")."""

    steps: int = Field(gt=0, description="decisions of vehicles to learn from")
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


class HierarchicalSettings(Table):
    """All settings of a run; ``hierarchical.toml`` holds the shipped ones."""

    traffic: TrainingTraffic
    reward: Reward = Reward()
    learner: LearnerSettings
    validation: Validation = Validation()


def train_hierarchical(options: Options) -> None:
    """Train the low level as published."""
    train("hierarchical", options)


def train_tuned(options: Options) -> None:
    """Train the low level under time windows."""
    train("hierarchical-tuned", options)


def train(name: str, options: Options) -> None:
    """Train until the steps are done or somebody stops it.

    Args:
        name: of the hierarchy.
        options: of the command.

    Raises:
        RightOfWayError: settings, scenarios or the folder make no sense.
    """
    settings = read_settings(
        HierarchicalSettings,
        Path(__file__).with_name(f"{name}.toml"),
        options,
        {
            "traffic.scenarios": options.scenarios,
            "traffic.rates": options.rates,
            "learner.steps": options.steps,
        },
    )
    scenarios = catalogue.find(settings.traffic.scenarios)
    folder = Folder(options, name, settings)
    torch.set_num_threads(1)  # other bits with other counts
    run = _Run(name, settings, scenarios, folder, options)
    if options.resume:
        run.course.restore()
    with working(options.workers) as workers, Interrupts(options.notify) as interrupts:
        run.go(workers, interrupts)


class _Run:
    """A training run under way."""

    def __init__(
        self,
        name: str,
        settings: HierarchicalSettings,
        scenarios: Sequence[Scenario],
        folder: Folder,
        options: Options,
    ) -> None:
        learner = settings.learner
        self._name, self._settings, self._scenarios = name, settings, scenarios
        self._seed = options.seed
        self._model = _model(learner, KINDS[name].SIZE, options.seed)
        self.course = Course(self._model, folder, options, settings.validation, learner.steps)

    def go(self, workers: "ProcessPool", interrupts: Interrupts) -> None:
        """Play and learn, round by round."""
        course = self.course
        with course.shown() as show:
            while not (course.is_done or interrupts.wanted):
                self._learn(self._play(workers))
                if course.validates or course.is_done:
                    self._validate(workers)
                    course.save()
                show()
            course.save()
        if not course.is_done:
            course.stop()
        course.finish(hidden=self._settings.learner.hidden)

    def _play(self, workers: "ProcessPool") -> list[Played]:
        """Play this round's episodes."""
        random = np.random.default_rng([self._seed, self.course.round])
        starts = training_episodes(self._settings.traffic, self._scenarios, random)
        policy = ppo.arrays(self._model, explores=True)
        gridlock_after = self._settings.traffic.gridlock_after
        return _played(workers, (self._rollout(one, policy, gridlock_after) for one in starts))

    def _learn(self, played: Sequence[Played]) -> None:
        """Take PPO's epochs on a round."""
        trajectories = [one for episode in played for one in episode.trajectories]
        if not trajectories:
            raise UsageError("no RV was stopped in a whole round; give higher rates or more time")
        learner, model, course = self._settings.learner, self._model, self.course
        random = np.random.default_rng([self._seed, course.round, 1])
        model.rollout_buffer = ppo.Batch(  # type: ignore[assignment]
            model, trajectories, learner.discount, learner.decay, random
        )
        model.train()
        course.round += 1
        course.decisions += sum(len(one.rewards) for one in trajectories)
        actions = np.concatenate([one.actions for one in trajectories])
        course.log(
            played,
            reward=fmean(float(one.rewards.mean()) for one in trajectories),
            acceleration=float(actions[:, 0].mean()),
            lane_changes=float((np.abs(actions[:, 1]) > 0.33).mean()),
        )

    def _validate(self, workers: "ProcessPool") -> None:
        """Score the mean actions on the validation episodes."""
        policy = ppo.arrays(self._model, explores=False)
        starts = validation_episodes(self._settings.validation, self._scenarios)
        played = _played(workers, (self._rollout(one, policy) for one in starts))
        self.course.judge(played, policy)

    def _rollout(
        self, start: Start, policy: ppo.Arrays, gridlock_after: float = GRIDLOCK_AFTER
    ) -> Rollout:
        return Rollout(self._name, *start, policy, self._settings.reward, gridlock_after)


def _played(workers: "ProcessPool", rollouts: Iterable[Rollout]) -> list[Played]:
    """Play rollouts side by side; the results come in their order."""
    futures: list[Future[Played]] = [workers.schedule(play, args=(one,)) for one in rollouts]
    return [result_of(future) for future in futures]


def _model(learner: LearnerSettings, size: int, seed: int) -> PPO:
    found = PPO(
        "MlpPolicy",
        ppo.SpacesOnly(size),
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
        bias = found.policy.action_net.bias
        assert isinstance(bias, torch.Tensor)
        bias.copy_(torch.tensor([learner.forward, 0.0]))
    return found

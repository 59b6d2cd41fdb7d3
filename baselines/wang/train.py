"""Trains Wang's controller: rounds of episodes in worker processes, then gradient steps.

The workers play round k + 1 with the weights of round k - 1 while the learner takes its steps on
round k, so equal seeds give equal weights however many workers there are.
"""

import json
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

import numpy as np
import torch
from pydantic import Field, PositiveInt, field_validator

from baselines.wang.dqn import DuelingPolicy, PrioritisedReplay, SpacesOnly, WangDQN
from baselines.wang.policy import HIDDEN, Greedy, shapes
from benchmark.learning.course import Course, arrays, tensors
from benchmark.learning.observation import Layout, size
from benchmark.learning.rollout import Played, Rollout, Workers
from benchmark.learning.run import (
    Folder,
    Interrupts,
    Options,
    TrainingTraffic,
    Validation,
    read_settings,
    training_episodes,
    validation_episodes,
)
from benchmark.learning.traffic import Reward
from benchmark.learning.weights import Arrays
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.models import Table
from benchmark.plumbing.processes import result_of
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario

HERE = Path(__file__).parent


class LearnerSettings(Table):
    """Deep Q-learning with the published ingredients (Wang et al.)."""

    steps: int = Field(gt=0, description="decisions of vehicles to learn from")
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


class WangSettings(Table):
    """All settings of a run; ``wang.toml`` and ``wang-tuned.toml`` hold the shipped ones."""

    layout: Layout = "paper"
    traffic: TrainingTraffic
    reward: Reward = Reward()
    learner: LearnerSettings
    validation: Validation = Validation()


def train_wang(options: Options) -> None:
    """Train ``wang``."""
    train("wang", options)


def train_tuned(options: Options) -> None:
    """Train ``wang-tuned``."""
    train("wang-tuned", options)


def train(name: str, options: Options) -> None:
    """Train until the steps are done or somebody stops it.

    Args:
        name: which shipped settings to begin with.
        options: of the command.

    Raises:
        RightOfWayError: settings, scenarios or the folder make no sense.
    """
    settings = read_settings(
        WangSettings,
        HERE / f"{name}.toml",
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
    run = _Run(settings, scenarios, folder, options)
    if options.resume:
        run.restore()
    with Workers(options.workers) as workers, Interrupts(options.notify) as interrupts:
        run.go(workers, interrupts)


@dataclass
class _Turn:
    """A round under way in the workers."""

    acting: Arrays
    playing: "list[Future[Played]]"
    validating: "list[Future[Played]]"


class _Run:
    """A training run under way."""

    def __init__(
        self,
        settings: WangSettings,
        scenarios: Sequence[Scenario],
        folder: Folder,
        options: Options,
    ) -> None:
        self._settings, self._scenarios, self._seed = settings, scenarios, options.seed
        self._model = _model(settings, options.seed)
        self._course = Course(
            self._model, folder, options, settings.validation, settings.learner.steps
        )
        self._acting = self._snapshot()

    # --- the loop --------------------------------------------------------------------------

    def go(self, workers: Workers, interrupts: Interrupts) -> None:
        """Play and learn, round by round."""
        course = self._course
        with course.shown() as show:
            turn = None if course.is_done else self._start(workers)
            while turn is not None and not interrupts.wanted:
                turn = self._take(turn, workers)
                if course.validates:
                    self.save()
                if turn is not None:
                    show()
            self.save()
            if turn is None:
                self._acting = self._snapshot()
                self._judge(self._validation(workers), self._acting)
                show()
        if turn is not None:
            course.stop()
        self._finish()

    def _take(self, turn: _Turn, workers: Workers) -> _Turn | None:
        """Learn from a turn while the next is played; None where there is none."""
        played = [result_of(future) for future in turn.playing]
        course, before = self._course, self._course.decisions
        course.decisions += sum(len(t.actions) for one in played for t in one.trajectories)
        if course.decisions == before:
            raise UsageError("nobody decided in a whole round; give higher rates or more time")
        course.round += 1
        self._acting = self._snapshot()
        following = None if course.is_done else self._start(workers)
        self._learn(played, before)
        if turn.validating:
            self._judge(turn.validating, turn.acting)
        return following

    def _start(self, workers: Workers) -> _Turn:
        """Start this round's episodes, and its validation if it has one."""
        playing = self._play(workers)
        due = self._course.validates
        return _Turn(self._acting, playing, self._validation(workers) if due else [])

    def _play(self, workers: Workers) -> "list[Future[Played]]":
        """Start this round's episodes with the acting weights."""
        settings = self._settings
        random = np.random.default_rng([self._seed, self._course.round])
        rollouts = [
            Rollout(
                *start,
                settings.layout,
                settings.reward,
                exploration=self._exploration(),
                discount=settings.learner.discount,
                gridlock_after=settings.traffic.gridlock_after,
            )
            for start in training_episodes(settings.traffic, self._scenarios, random)
        ]
        return workers.play(rollouts, Greedy(self._acting))

    def _exploration(self) -> float:
        learner = self._settings.learner
        done = min(1.0, self._course.decisions / (learner.exploring * learner.steps))
        return 1.0 + done * (learner.exploration - 1.0)

    def _learn(self, played: Sequence[Played], before: int) -> None:
        """Fill the replay and take the steps that are due.

        Args:
            played: the episodes of a round.
            before: decisions until then.
        """
        learner, decisions = self._settings.learner, self._course.decisions
        trajectories = [one for episode in played for one in episode.trajectories]
        for trajectory in trajectories:
            self._model.replay_buffer.extend(trajectory)
        due = learner.decisions_per_update
        if self._model.replay_buffer.size() >= learner.batch:
            self._model.train(decisions // due - before // due, learner.batch)
        self._course.log(
            played,
            reward=sum(float(one.rewards.sum()) for one in trajectories) / (decisions - before),
            go=fmean(float(one.actions.mean()) for one in trajectories),
            exploration=self._exploration(),
        )

    # --- validation ------------------------------------------------------------------------

    def _validation(self, workers: Workers) -> "list[Future[Played]]":
        settings = self._settings
        starts = validation_episodes(settings.validation, self._scenarios)
        rollouts = [Rollout(*start, settings.layout, settings.reward) for start in starts]
        return workers.play(rollouts, Greedy(self._acting))

    def _judge(self, playing: "Sequence[Future[Played]]", acting: Arrays) -> None:
        self._course.judge([result_of(future) for future in playing], acting)

    # --- what stays ------------------------------------------------------------------------

    def _snapshot(self) -> Arrays:
        return {
            name: one.detach().numpy().copy()
            for name, one in self._model.q_net.state_dict().items()
        }

    def save(self) -> None:
        """Write a checkpoint from which the run goes on exactly as if it had not stopped."""
        replay = self._model.replay_buffer
        held = replay.size()
        self._course.save(
            replay={name: torch.from_numpy(getattr(replay, name)[:held]) for name in _REPLAYED},
            place=(replay.pos, replay.full),
            random=json.dumps(replay.random.bit_generator.state),
            acting=tensors(self._acting),
        )

    def restore(self) -> None:
        """Continue from the checkpoint."""
        content, replay = self._course.restore(), self._model.replay_buffer
        for name, one in content["replay"].items():
            getattr(replay, name)[: len(one)] = one.numpy()
        replay.pos, replay.full = content["place"]
        replay.random.bit_generator.state = json.loads(content["random"])
        self._acting = arrays(content["acting"])

    def _finish(self) -> None:
        assert self._course.best is not None
        settings, best = self._settings, self._course.best
        expected = shapes(settings.layout, settings.learner.hidden, settings.learner.atoms)
        assert {name: one.shape for name, one in best.arrays.items()} == expected
        self._course.finish(
            layout=settings.layout, hidden=settings.learner.hidden, atoms=settings.learner.atoms
        )


_REPLAYED = (
    *("observations", "next_observations", "actions", "rewards"),
    *("dones", "discounts", "priorities"),
)


def _model(settings: WangSettings, seed: int) -> WangDQN:
    learner = settings.learner
    model = WangDQN(
        DuelingPolicy,
        SpacesOnly(size(settings.layout)),
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

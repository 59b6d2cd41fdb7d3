"""Trains Wang's controller: rounds of episodes in worker processes, then gradient steps.

The workers play round k + 1 with the weights of round k - 1 while the learner takes its steps on
round k, so equal seeds give equal weights however many workers there are.
"""

import json
import pickle
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import torch
from pydantic import Field, PositiveInt, field_validator
from rich import progress
from rich.console import Console
from stable_baselines3.common.logger import Logger, make_output_format

from baselines.wang.dqn import DuelingPolicy, PrioritisedReplay, SpacesOnly, WangDQN
from baselines.wang.policy import HIDDEN, Greedy, shapes
from benchmark import catalogue
from benchmark.errors import UsageError
from benchmark.learning import weights as files
from benchmark.learning.observation import Layout, size
from benchmark.learning.rollout import Played, Rollout, Workers
from benchmark.learning.run import (
    Folder,
    Interrupts,
    Options,
    Table,
    TrainingTraffic,
    Validation,
    read_settings,
    replaced,
    training_rollouts,
    validation_rollouts,
)
from benchmark.learning.traffic import Reward
from benchmark.scenario import Scenario
from benchmark.workers import result_of

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
class _Score:
    """How good weights are on the validation episodes."""

    waiting: float  # s, mean over episodes
    gridlocked: int
    arrays: files.Arrays
    round: int


@dataclass
class _Turn:
    """A round under way in the workers."""

    acting: files.Arrays
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
        self._settings, self._scenarios, self._folder = settings, scenarios, folder
        self._seed, self._notify = options.seed, options.notify
        self._model = _model(settings, options.seed)
        self._round = self._decisions = 0
        self._acting = self._snapshot()
        self._best: _Score | None = None

    # --- the loop --------------------------------------------------------------------------

    def go(self, workers: Workers, interrupts: Interrupts) -> None:
        """Play and learn, round by round."""
        self._model.set_logger(self._logger())
        steps = self._settings.learner.steps
        columns = (
            progress.TextColumn("{task.completed:,}/{task.total:,} decisions"),
            progress.BarColumn(),
            progress.TimeElapsedColumn(),
            progress.TextColumn("left"),
            progress.TimeRemainingColumn(),
            progress.TextColumn("{task.description}"),
        )
        with progress.Progress(*columns, console=Console(stderr=True)) as bar:
            task = bar.add_task(self._status(), total=steps, completed=self._decisions)
            turn = self._start(workers) if self._decisions < steps else None
            while turn is not None and not interrupts.wanted:
                turn = self._take(turn, workers)
                bar.update(task, completed=min(steps, self._decisions), description=self._status())
                if self._round % self._settings.validation.rounds == 0:
                    self.save()
            self.save()
        if turn is not None:
            self._notify(f"stopped; continue with --resume --out {self._folder.path}")
            raise KeyboardInterrupt
        self._acting = self._snapshot()
        self._judge([result_of(future) for future in self._validation(workers)], self._acting)
        self._finish()

    def _logger(self) -> Logger:
        """Logs of this session; one that resumes writes files beside those of the others."""
        folder = str(self._folder.path / "logs")
        suffix = f"-from-{self._round}" if self._round else ""
        forms = [make_output_format(form, folder, suffix) for form in ("csv", "tensorboard")]
        return Logger(folder, forms)

    def _take(self, turn: "_Turn", workers: Workers) -> "_Turn | None":
        """Learn from a turn while the next is played; None where there is none."""
        played = [result_of(future) for future in turn.playing]
        before = self._decisions
        self._decisions += sum(len(t.actions) for one in played for t in one.trajectories)
        if self._decisions == before:
            raise UsageError("nobody decided in a whole round; give higher rates or more time")
        self._round += 1
        self._acting = self._snapshot()
        following = None
        if self._decisions < self._settings.learner.steps:
            following = self._start(workers)
        self._learn(played, before)
        if turn.validating:
            self._judge([result_of(future) for future in turn.validating], turn.acting)
        return following

    def _start(self, workers: Workers) -> "_Turn":
        """Start this round's episodes, and its validation if it has one."""
        due = self._round > 0 and self._round % self._settings.validation.rounds == 0
        return _Turn(self._acting, self._play(workers), self._validation(workers) if due else [])

    def _status(self) -> str:
        if self._best is None:
            return "not validated yet"
        return f"best validation {self._best.waiting:.1f} s"

    def _play(self, workers: Workers) -> "list[Future[Played]]":
        """Start this round's episodes with the acting weights."""
        settings = self._settings
        rollouts = training_rollouts(
            settings.traffic,
            self._scenarios,
            np.random.default_rng([self._seed, self._round]),
            layout=settings.layout,
            reward=settings.reward,
            exploration=self._exploration(),
            discount=settings.learner.discount,
        )
        return workers.play(rollouts, Greedy(self._acting))

    def _exploration(self) -> float:
        learner = self._settings.learner
        done = min(1.0, self._decisions / (learner.exploring * learner.steps))
        return 1.0 + done * (learner.exploration - 1.0)

    def _learn(self, played: Sequence[Played], before: int) -> None:
        """Fill the replay and take the steps that are due.

        Args:
            played: the episodes of a round.
            before: decisions until then.
        """
        learner = self._settings.learner
        trajectories = [one for episode in played for one in episode.trajectories]
        for trajectory in trajectories:
            self._model.replay_buffer.extend(trajectory)
        due = learner.decisions_per_update
        updates = self._decisions // due - before // due
        if self._model.replay_buffer.size() >= learner.batch:
            self._model.train(updates, learner.batch)
        log = self._model.logger
        log.record("rollout/waiting", fmean(one.average_waiting_time or 0.0 for one in played))
        log.record("rollout/gridlocked", sum(one.gridlocked for one in played))
        if trajectories:
            rewards = sum(float(one.rewards.sum()) for one in trajectories)
            log.record("rollout/reward", rewards / (self._decisions - before))
            log.record("rollout/go", fmean(float(one.actions.mean()) for one in trajectories))
        log.record("rollout/exploration", self._exploration())
        log.dump(self._decisions)

    # --- validation ------------------------------------------------------------------------

    def _validation(self, workers: Workers) -> "list[Future[Played]]":
        rollouts: list[Rollout] = validation_rollouts(
            self._settings.validation,
            self._scenarios,
            self._settings.layout,
            self._settings.reward,
        )
        return workers.play(rollouts, Greedy(self._acting))

    def _judge(self, played: Sequence[Played], acting: files.Arrays) -> None:
        """Score weights by the validation episodes played with them, and keep the best so far."""
        gridlock = self._settings.validation.gridlock
        waiting = fmean(
            gridlock if one.gridlocked else one.average_waiting_time or 0.0 for one in played
        )
        jams = sum(one.gridlocked for one in played)
        score = _Score(waiting, jams, acting, self._round)
        self._model.logger.record("validation/waiting", waiting)
        self._model.logger.record("validation/gridlocked", jams)
        if self._best is None or waiting < self._best.waiting:
            self._best = score
        self._notify(
            f"{self._decisions:,} decisions: validation {waiting:.2f} s, "
            f"{jams} of {len(played)} episodes gridlocked"
        )
        self._folder.note(
            validated=[
                *self._folder.manifest.get("validated", []),
                {"decisions": self._decisions, "waiting": round(waiting, 3), "gridlocked": jams},
            ]
        )

    # --- what stays ------------------------------------------------------------------------

    def _snapshot(self) -> files.Arrays:
        return {
            name: one.detach().numpy().copy()
            for name, one in self._model.q_net.state_dict().items()
        }

    def save(self) -> None:
        """Write a checkpoint from which the run goes on exactly as if it had not stopped."""
        replay, model = self._model.replay_buffer, self._model
        held = replay.size()
        best = self._best
        content = {
            "policy": model.policy.state_dict(),
            "optimizer": model.policy.optimizer.state_dict(),
            "replay": {name: torch.from_numpy(getattr(replay, name)[:held]) for name in _REPLAYED},
            "place": (replay.pos, replay.full),
            "random": json.dumps(replay.random.bit_generator.state),
            "updates": model._n_updates,
            "round": self._round,
            "decisions": self._decisions,
            "acting": _tensors(self._acting),
            "best": best and (best.waiting, best.gridlocked, best.round, _tensors(best.arrays)),
            "validated": json.dumps(self._folder.manifest.get("validated", [])),
        }
        with replaced(self._folder.checkpoint) as path:
            torch.save(content, path)
        self._folder.note(round=self._round, decisions=self._decisions)

    def restore(self) -> None:
        """Continue from the checkpoint."""
        try:
            content: dict[str, Any] = torch.load(self._folder.checkpoint, weights_only=True)
        except (OSError, RuntimeError, pickle.UnpicklingError) as error:
            raise UsageError(
                f"{self._folder.checkpoint}: damaged; start anew with another --out"
            ) from error
        replay, model = self._model.replay_buffer, self._model
        model.policy.load_state_dict(content["policy"])
        model.policy.optimizer.load_state_dict(content["optimizer"])
        for name, one in content["replay"].items():
            getattr(replay, name)[: len(one)] = one.numpy()
        replay.pos, replay.full = content["place"]
        replay.random.bit_generator.state = json.loads(content["random"])
        model._n_updates = content["updates"]
        self._round, self._decisions = content["round"], content["decisions"]
        self._acting = _arrays(content["acting"])
        if content["best"] is not None:
            waiting, jams, at, arrays = content["best"]
            self._best = _Score(waiting, jams, _arrays(arrays), at)
        self._folder.note(validated=json.loads(content["validated"]))

    def _finish(self) -> None:
        assert self._best is not None
        settings, best, path = self._settings, self._best, self._folder.path / "weights.safetensors"
        expected = shapes(settings.layout, settings.learner.hidden, settings.learner.atoms)
        assert {name: one.shape for name, one in best.arrays.items()} == expected
        notes = {
            "layout": settings.layout,
            "hidden": settings.learner.hidden,
            "atoms": settings.learner.atoms,
            "settings": settings.model_dump(mode="json"),
            "seed": self._seed,
            "round": best.round,
            "validation": {"waiting": best.waiting, "gridlocked": best.gridlocked},
        }
        files.save(path, best.arrays, notes)
        self._folder.note(
            finished=True, digest=files.digest(best.arrays), validation=round(best.waiting, 3)
        )
        self._notify(f"{path}: validation {best.waiting:.2f} s, {best.gridlocked} gridlocked")


_REPLAYED = (
    *("observations", "next_observations", "actions", "rewards"),
    *("dones", "discounts", "priorities"),
)


def _tensors(arrays: files.Arrays) -> dict[str, torch.Tensor]:
    return {name: torch.from_numpy(np.asarray(one)) for name, one in arrays.items()}


def _arrays(tensors: dict[str, torch.Tensor]) -> files.Arrays:
    return {name: one.numpy() for name, one in tensors.items()}


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

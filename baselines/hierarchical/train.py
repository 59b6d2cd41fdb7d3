"""Trains the low level: rounds of episodes in worker processes, then PPO's epochs on all of them.

A round is played with the weights that learn from it, so equal seeds give equal weights however
many workers there are.
"""

import json
import pickle
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import closing
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import torch
from pydantic import Field, PositiveInt
from rich import progress
from rich.console import Console
from stable_baselines3 import PPO
from stable_baselines3.common.logger import Logger, make_output_format

from baselines.hierarchical import ppo
from baselines.hierarchical.reward import Reward
from baselines.hierarchical.rollout import KINDS, Played, Rollout, play
from benchmark import catalogue
from benchmark.errors import UsageError
from benchmark.learning import weights as files
from benchmark.learning.run import (
    FIRST_TRAINING_SEED,
    VALIDATION_SEEDS,
    Folder,
    Interrupts,
    Options,
    Table,
    TrainingTraffic,
    Validation,
    read_settings,
    replaced,
)
from benchmark.scenario import Scenario
from benchmark.workers import result_of, working

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
        run.restore()
    with (
        working(options.workers) as workers,
        Interrupts(options.notify) as interrupts,
        closing(run.logger()) as logger,
    ):
        run.go(workers, interrupts, logger)


class _Score(NamedTuple):
    """How good weights are on the validation episodes."""

    waiting: float  # s, mean over episodes
    gridlocked: int
    round: int
    arrays: ppo.Arrays


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
        self._name, self._settings = name, settings
        self._scenarios, self._folder = scenarios, folder
        self._seed, self._notify = options.seed, options.notify
        self._model = _model(settings.learner, KINDS[name].SIZE, options.seed)
        self._round = self._decisions = 0
        self._best: _Score | None = None

    # --- the loop --------------------------------------------------------------------------

    def go(self, workers: "ProcessPool", interrupts: Interrupts, logger: Logger) -> None:
        """Play and learn, round by round."""
        self._model.set_logger(logger)
        total = self._settings.learner.steps
        columns = (
            progress.TextColumn("{task.completed:,}/{task.total:,} decisions"),
            progress.BarColumn(),
            progress.TimeElapsedColumn(),
            progress.TextColumn("left"),
            progress.TimeRemainingColumn(),
            progress.TextColumn("{task.description}"),
        )
        with progress.Progress(*columns, console=Console(stderr=True)) as bar:
            task = bar.add_task(self._status(), total=total, completed=self._decisions)
            while self._decisions < total and not interrupts.wanted:
                self._learn(list(_results(workers, self._rollouts())))
                if self._round % self._settings.validation.rounds == 0:
                    self._validate(workers)
                    self.save()
                bar.update(task, completed=min(total, self._decisions), description=self._status())
            self.save()
        if self._decisions < total:
            self._notify(f"stopped; continue with --resume --out {self._folder.path}")
            raise KeyboardInterrupt
        if self._round % self._settings.validation.rounds:
            self._validate(workers)
        self._finish()

    def _status(self) -> str:
        if self._best is None:
            return "not validated yet"
        return f"best validation {self._best.waiting:.1f} s"

    def logger(self) -> Logger:
        """Logs of this session; one that resumes writes files beside those of the others."""
        folder = str(self._folder.path / "logs")
        suffix = f"-from-{self._round}" if self._round else ""
        forms = [make_output_format(form, folder, suffix) for form in ("csv", "tensorboard")]
        return Logger(folder, forms)

    def _rollouts(self) -> Iterator[Rollout]:
        """This round's episodes: the scenarios by turns, rate, demand and seed drawn."""
        traffic = self._settings.traffic
        random = np.random.default_rng([self._seed, self._round])
        policy = ppo.arrays(self._model, explores=True)
        for index in range(traffic.episodes):
            scenario = self._scenarios[index % len(self._scenarios)]
            evaluation = scenario.evaluation.model_copy(
                update={"duration": traffic.duration, "warm_up": 0.0}
            )
            scenario = scenario.with_demand(float(random.choice(traffic.demand)))
            yield Rollout(
                self._name,
                scenario.with_evaluation(evaluation),
                float(random.choice(traffic.rates)),
                FIRST_TRAINING_SEED + int(random.integers(traffic.seeds)),
                policy,
                self._settings.reward,
                traffic.gridlock_after,
            )

    def _learn(self, played: Sequence[Played]) -> None:
        """Take PPO's epochs on a round."""
        trajectories = [one for episode in played for one in episode.trajectories]
        if not trajectories:
            raise UsageError("no RV was stopped in a whole round; give higher rates or more time")
        learner, model = self._settings.learner, self._model
        random = np.random.default_rng([self._seed, self._round, 1])
        model.rollout_buffer = ppo.Batch(  # type: ignore[assignment]
            model, trajectories, learner.discount, learner.decay, random
        )
        model.train()
        self._round += 1
        self._decisions += sum(len(one.rewards) for one in trajectories)
        log = model.logger
        log.record("rollout/waiting", fmean(one.average_waiting_time or 0.0 for one in played))
        log.record("rollout/gridlocked", sum(one.gridlocked for one in played))
        log.record("rollout/reward", fmean(float(one.rewards.mean()) for one in trajectories))
        actions = np.concatenate([one.actions for one in trajectories])
        log.record("rollout/acceleration", float(actions[:, 0].mean()))
        log.record("rollout/lane_changes", float((np.abs(actions[:, 1]) > 0.33).mean()))
        log.dump(self._decisions)

    # --- validation ------------------------------------------------------------------------

    def _validate(self, workers: "ProcessPool") -> None:
        """Score the mean actions on the validation episodes, and keep the best so far."""
        validation = self._settings.validation
        policy = ppo.arrays(self._model, explores=False)
        played = list(
            _results(
                workers,
                (
                    Rollout(self._name, scenario, rate, seed, policy, self._settings.reward)
                    for scenario in self._scenarios
                    for rate in validation.rates
                    for seed in VALIDATION_SEEDS[: validation.seeds]
                ),
            )
        )
        jams = sum(one.gridlocked for one in played)
        waiting = fmean(
            validation.gridlock if one.gridlocked else one.average_waiting_time or 0.0
            for one in played
        )
        if self._best is None or waiting < self._best.waiting:
            self._best = _Score(waiting, jams, self._round, policy)
        self._notify(
            f"{self._decisions:,} decisions: validation {waiting:.2f} s, "
            f"{jams} of {len(played)} episodes gridlocked"
        )
        found = {"decisions": self._decisions, "waiting": round(waiting, 3), "gridlocked": jams}
        self._folder.note(validated=[*self._folder.manifest.get("validated", []), found])

    # --- what stays ------------------------------------------------------------------------

    def save(self) -> None:
        """Write a checkpoint from which the run goes on exactly as if it had not stopped."""
        best = self._best
        content = {
            "policy": self._model.policy.state_dict(),
            "optimizer": self._model.policy.optimizer.state_dict(),
            "updates": self._model._n_updates,
            "round": self._round,
            "decisions": self._decisions,
            "best": best and (*best[:3], _tensors(best.arrays)),
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
        self._model.policy.load_state_dict(content["policy"])
        self._model.policy.optimizer.load_state_dict(content["optimizer"])
        self._model._n_updates = content["updates"]
        self._round, self._decisions = content["round"], content["decisions"]
        if content["best"] is not None:
            waiting, jams, at, tensors = content["best"]
            found = {name: one.numpy() for name, one in tensors.items()}
            self._best = _Score(waiting, jams, at, found)
        self._folder.note(validated=json.loads(content["validated"]))

    def _finish(self) -> None:
        assert self._best is not None
        settings, best, path = self._settings, self._best, self._folder.path / "weights.safetensors"
        notes = {
            "hidden": settings.learner.hidden,
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


def _results(workers: "ProcessPool", rollouts: Iterator[Rollout]) -> Iterator[Played]:
    """Play rollouts side by side; the results come in their order."""
    futures: list[Future[Played]] = [workers.schedule(play, args=(one,)) for one in rollouts]
    for future in futures:
        yield result_of(future)


def _tensors(arrays: ppo.Arrays) -> dict[str, torch.Tensor]:
    return {name: torch.from_numpy(one) for name, one in arrays.items()}


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

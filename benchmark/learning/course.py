"""How far a training run has come: rounds, decisions, the best weights so far, and its checkpoint.

The same whatever is learnt with a model of Stable-Baselines3; needs the training extras.
"""

import json
import pickle
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from statistics import fmean
from typing import Any, NamedTuple, NoReturn

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger, make_output_format

from benchmark.learning import weights as files
from benchmark.learning.folder import Folder
from benchmark.learning.rollout import Played
from benchmark.learning.run import bar
from benchmark.learning.settings import Options, Validation
from benchmark.learning.weights import Arrays
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.files import replaced


class Score(NamedTuple):
    """How good weights are on the validation episodes."""

    waiting: float  # s, mean over episodes
    gridlocked: int
    round: int
    arrays: Arrays


class Course:
    """A training run under way.

    Args:
        model: what learns.
        folder: of the run.
        options: of the command.
        validation: how weights are judged.
        steps: decisions of vehicles to learn from, at least; the round in which they are reached
            is played to its end.
    """

    def __init__(
        self,
        model: BaseAlgorithm,
        folder: Folder,
        options: Options,
        validation: Validation,
        steps: int,
    ) -> None:
        self._model, self._folder, self._validation = model, folder, validation
        self._seed, self._notify = options.seed, options.notify
        self.steps = steps
        self.round = self.decisions = 0
        self.best: Score | None = None

    @property
    def is_done(self) -> bool:
        """Whether there have been decisions enough."""
        return self.decisions >= self.steps

    @property
    def validates(self) -> bool:
        """Whether a validation belongs to the rounds there have been."""
        return self.round > 0 and self.round % self._validation.rounds == 0

    @contextmanager
    def shown(self) -> Iterator[Callable[[], None]]:
        """Logs and a bar. What this gives is to be called at the end of each round.

        Logs of a session that resumes are files beside those of the others.
        """
        folder = str(self._folder.path / "logs")
        suffix = f"-from-{self.round}" if self.round else ""
        forms = [make_output_format(form, folder, suffix) for form in ("csv", "tensorboard")]
        with closing(Logger(folder, forms)) as logger, bar("decisions") as display:
            self._model.set_logger(logger)
            task = display.add_task(self._status(), completed=self.decisions, total=self.steps)

            def move() -> None:
                display.update(task, completed=self.decisions, description=self._status())
                logger.dump(self.decisions)

            yield move

    def _status(self) -> str:
        if self.best is None:
            return "not validated yet"
        return f"best validation {self.best.waiting:.1f} s"

    def log(self, played: Sequence[Played], **facts: float) -> None:
        """Note a round for the logs: its episodes, and what else there is to say."""
        log = self._model.logger
        log.record(
            "rollout/waiting", fmean(episode.average_waiting_time or 0.0 for episode in played)
        )
        log.record("rollout/gridlocked", sum(episode.gridlocked for episode in played))
        for name, value in facts.items():
            log.record(f"rollout/{name}", value)

    def judge(self, played: Sequence[Played], arrays: Arrays) -> None:
        """Score weights by the validation episodes played with them, and keep the best so far."""
        waiting = fmean(
            self._validation.gridlock if episode.gridlocked else episode.average_waiting_time or 0.0
            for episode in played
        )
        jams = sum(episode.gridlocked for episode in played)
        self._model.logger.record("validation/waiting", waiting)
        self._model.logger.record("validation/gridlocked", jams)
        if self.best is None or waiting < self.best.waiting:
            self.best = Score(waiting, jams, self.round, arrays)
        self._notify(
            f"{self.decisions:,} decisions: validation {waiting:.2f} s, "
            f"{jams} of {len(played)} episodes gridlocked"
        )
        entry = {"decisions": self.decisions, "waiting": round(waiting, 3), "gridlocked": jams}
        self._folder.note(validated=[*self._folder.manifest.get("validated", []), entry])

    def save(self, **more: Any) -> None:
        """Write a checkpoint from which the run goes on exactly as if it had not stopped.

        Args:
            more: what else the run goes on from; nothing that needs pickle.
        """
        best = self.best
        content = {
            "policy": self._model.policy.state_dict(),
            "optimizer": self._model.policy.optimizer.state_dict(),
            "updates": self._model._n_updates,
            "round": self.round,
            "decisions": self.decisions,
            "best": best and (*best[:-1], tensors(best.arrays)),
            "validated": json.dumps(self._folder.manifest.get("validated", [])),
        }
        with replaced(self._folder.checkpoint) as path:
            torch.save(content | more, path)
        self._folder.note(round=self.round, decisions=self.decisions)

    def restore(self) -> Mapping[str, Any]:
        """Continue from the checkpoint; what it holds.

        Raises:
            UsageError: it is damaged.
        """
        try:
            content: dict[str, Any] = torch.load(self._folder.checkpoint, weights_only=True)
        except (OSError, RuntimeError, EOFError, LookupError, pickle.UnpicklingError) as error:
            raise UsageError(
                f"{self._folder.checkpoint}: damaged; start anew with another --out"
            ) from error
        self._model.policy.load_state_dict(content["policy"])
        self._model.policy.optimizer.load_state_dict(content["optimizer"])
        self._model._n_updates = content["updates"]
        self.round, self.decisions = content["round"], content["decisions"]
        if content["best"] is not None:
            waiting, jams, at, weights = content["best"]
            self.best = Score(waiting, jams, at, arrays(weights))
        self._folder.note(validated=json.loads(content["validated"]))
        return content

    def stop(self) -> NoReturn:
        """End before it is done, as somebody wished."""
        self._notify(f"stopped; continue with --resume --out {self._folder.path}")
        raise KeyboardInterrupt

    def finish(self, **notes: Any) -> None:
        """Write the best weights.

        Args:
            notes: what a controller needs to know of them.
        """
        assert self.best is not None
        best, path = self.best, self._folder.path / "weights.safetensors"
        notes |= {
            "settings": self._folder.manifest["settings"],
            "seed": self._seed,
            "round": best.round,
            "validation": {"waiting": best.waiting, "gridlocked": best.gridlocked},
        }
        files.save(path, best.arrays, notes)
        self._folder.note(
            finished=True, digest=files.digest(best.arrays), validation=round(best.waiting, 3)
        )
        self._notify(f"{path}: validation {best.waiting:.2f} s, {best.gridlocked} gridlocked")
        self._notify(self._extent())

    def _extent(self) -> str:
        """From how much it learnt."""
        rounds = "1 round" if self.round == 1 else f"{self.round:,} rounds"
        learnt = f"learnt from {self.decisions:,} decisions in {rounds}"
        if self.decisions == self.steps:
            return learnt
        return f"{learnt}; {self.steps:,} were asked for, and a run ends with a whole round"


def tensors(weights: Arrays) -> dict[str, torch.Tensor]:
    """Arrays as a checkpoint holds them."""
    return {name: torch.from_numpy(np.asarray(array)) for name, array in weights.items()}


def arrays(weights: Mapping[str, torch.Tensor]) -> Arrays:
    """The same, back."""
    return {name: tensor.numpy() for name, tensor in weights.items()}

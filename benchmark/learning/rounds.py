"""A training run in rounds: workers play episodes, a model of Stable-Baselines3 learns from them.

What all trainers share. A round's episodes and a validation's depend on the seed and the weights
alone, so equal seeds give equal weights however many workers there are. Needs the training extras.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from pydantic import Field
from stable_baselines3.common.base_class import BaseAlgorithm

from benchmark.learning.course import Course, arrays, tensors
from benchmark.learning.folder import Folder
from benchmark.learning.observation import Numbers
from benchmark.learning.rollout import Played
from benchmark.learning.run import Start, interrupts, training_episodes, validation_episodes
from benchmark.learning.settings import Options, TrainingTraffic, Validation, read_settings
from benchmark.learning.weights import Arrays
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.models import Table
from benchmark.plumbing.processes import result_of, working
from benchmark.scenario import catalogue

if TYPE_CHECKING:
    from pebble import ProcessPool


class LearnerSettings(Table):
    """What every learner has."""

    steps: int = Field(
        gt=0, description="decisions of vehicles to learn from; the last round is played to its end"
    )


class RunSettings(Table):
    """What every run has."""

    traffic: TrainingTraffic
    learner: LearnerSettings
    validation: Validation = Validation()


Settings = TypeVar("Settings", bound=RunSettings)
Model = TypeVar("Model", bound=BaseAlgorithm)


@dataclass
class Turn:
    """A round under way in the workers."""

    acting: Arrays  # with which it is played
    playing: "list[Future[Played]]" = field(default_factory=list)
    validating: "list[Future[Played]]" = field(default_factory=list)


class Rounds(ABC, Generic[Settings, Model]):
    """A training run; a trainer says what its model is and how it learns.

    Args:
        name: of what is trained.
        file: the shipped settings.
        options: of the command.

    Raises:
        RightOfWayError: settings, scenarios or the folder make no sense.
    """

    kind: ClassVar[type[RunSettings]]
    ahead: ClassVar[bool]
    """Whether the next round is played already while the model learns from this one."""

    def __init__(self, name: str, file: Path, options: Options) -> None:
        changes = {
            "traffic.scenarios": options.scenarios,
            "traffic.rates": options.rates,
            "learner.steps": options.steps,
        }
        self.name, self._options = name, options
        self.settings: Settings = read_settings(self.kind, file, options, changes)  # type: ignore[assignment]
        self._scenarios = catalogue.find_scenarios(self.settings.traffic.scenarios)
        folder = Folder(options, name, self.settings)
        torch.set_num_threads(1)  # other bits with other counts
        self.model = self._new(options.seed)
        steps = self.settings.learner.steps
        self.course = Course(self.model, folder, options, self.settings.validation, steps)
        self._acting = self._snapshot()

    @abstractmethod
    def _new(self, seed: int) -> Model:
        """A model that has learnt nothing."""

    @abstractmethod
    def _snapshot(self) -> Arrays:
        """The weights now, as the policy in episodes reads them."""

    @abstractmethod
    def _episode(self, start: Start, acting: Arrays, *, learns: bool) -> Callable[[], Played]:
        """What plays an episode in a worker.

        Args:
            start: which.
            acting: weights.
            learns: whether it is one to learn from, which may explore, or one of a validation.
        """

    @abstractmethod
    def _learn(self, played: Sequence[Played], before: int) -> Mapping[str, float]:
        """Learn from a round's episodes; what there is to log.

        Args:
            played: the episodes.
            before: decisions until then.
        """

    @abstractmethod
    def _notes(self) -> Mapping[str, Any]:
        """What a controller needs to know of the weights."""

    def _kept(self) -> Mapping[str, Any]:
        """What else a checkpoint holds; nothing that needs pickle."""
        return {}

    def _resume(self, content: Mapping[str, Any]) -> None:
        """Take back what ``_kept`` gave."""

    def run(self) -> None:
        """Play and learn, round by round, until the steps are done or somebody stops it."""
        course, options = self.course, self._options
        if options.resume:
            content = course.restore()
            self._acting = arrays(content["acting"])
            self._resume(content)
        with (
            working(options.workers) as workers,
            interrupts(options.notify) as stop,
            course.shown() as show,
        ):
            turn = self._start(workers)
            while turn is not None and not stop.wanted:
                turn = self._take(turn, workers)
                if course.validates:
                    self._save()
                if turn is not None:
                    show()
            self._save()
            if turn is not None:
                course.stop()
            self._acting = self._snapshot()
            self._judge(Turn(self._acting, validating=self._validation(workers)))
            show()
        course.finish(**self._notes())

    def _start(self, workers: "ProcessPool") -> Turn | None:
        """Start a round's episodes, and its validation if it has one; None where all is done."""
        if self.course.is_done:
            return None
        random = np.random.default_rng([self._options.seed, self.course.round])
        starts = training_episodes(self.settings.traffic, self._scenarios, random)
        playing = self._play(workers, starts, learns=True)
        return Turn(
            self._acting, playing, self._validation(workers) if self.course.validates else []
        )

    def _validation(self, workers: "ProcessPool") -> "list[Future[Played]]":
        starts = validation_episodes(self.settings.validation, self._scenarios)
        return self._play(workers, starts, learns=False)

    def _play(
        self, workers: "ProcessPool", starts: Iterable[Start], *, learns: bool
    ) -> "list[Future[Played]]":
        episodes = [self._episode(start, self._acting, learns=learns) for start in starts]
        return [workers.schedule(episode) for episode in episodes]

    def _take(self, turn: Turn, workers: "ProcessPool") -> Turn | None:
        """Learn from a turn; the next one, or None where all is done."""
        played = [result_of(future) for future in turn.playing]
        course, before = self.course, self.course.decisions
        course.decisions += sum(len(way.actions) for each in played for way in each.trajectories)
        if course.decisions == before:
            raise UsageError("nobody decided in a whole round; give higher rates or more time")
        course.round += 1
        if self.ahead:
            self._acting = self._snapshot()
            following = self._start(workers)
            course.log(played, **self._learn(played, before))
            self._judge(turn)
        else:
            course.log(played, **self._learn(played, before))
            self._acting = self._snapshot()
            following = self._start(workers)
            if following is not None:
                self._judge(following)
        return following

    def _judge(self, turn: Turn) -> None:
        """Score a turn's weights by its validation, if it has one."""
        if turn.validating:
            self.course.judge([result_of(future) for future in turn.validating], turn.acting)

    def _save(self) -> None:
        self.course.save(acting=tensors(self._acting), **self._kept())


class SpacesOnly(gymnasium.Env[Numbers, Any]):
    """What Stable-Baselines3 asks for to learn the spaces; nothing is ever played in it.

    Args:
        size: of an observation, whose numbers lie in [0, 1].
        actions: the space of actions.
    """

    def __init__(self, size: int, actions: "spaces.Space[Any]") -> None:
        self.observation_space = spaces.Box(0.0, 1.0, (size,), np.float32)
        self.action_space = actions

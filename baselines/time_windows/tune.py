"""Searches the settings of time windows on validation seeds: ``rightofway train time-windows``."""

import inspect
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future
from itertools import product
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated

import optuna
from optuna.samplers import TPESampler
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import TrialState
from pydantic import Field, NonNegativeFloat, model_validator

from baselines.time_windows.controller import TimeWindows
from benchmark.control import plugins
from benchmark.control.training import VALIDATION_SEEDS
from benchmark.learning.folder import Folder
from benchmark.learning.run import bar, interrupts
from benchmark.learning.settings import Options, Reference, read_settings
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.interrupts import Interrupts
from benchmark.plumbing.messages import nearest
from benchmark.plumbing.models import Share, Table
from benchmark.plumbing.processes import working
from benchmark.records.record import Record
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario
from benchmark.study import outcome
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import all_episodes, build_ahead

if TYPE_CHECKING:
    from pebble import ProcessPool

NAME = "time-windows"
SHIPPED = {
    name: option.default for name, option in inspect.signature(TimeWindows).parameters.items()
}  # what ships: the defaults
FAILED = 10.0  # score of an episode that does not end well

Chosen = Mapping[str, float]
"""Settings of time windows by name."""


class SearchSettings(Table):
    """All settings of a search; ``time-windows.toml`` holds those that ship."""

    trials: int = Field(gt=0)
    reference: Reference = Field(description="controller without RVs; scores are relative to it")
    collision: NonNegativeFloat = Field(description="added for a collision with an RV per episode")
    scenarios: tuple[Reference, ...] = Field(min_length=1)
    rates: tuple[Share, ...] = Field(min_length=1)
    seeds: int = Field(gt=0, description="of each trial, from 1001 up")
    finalists: int = Field(gt=0, description="best trials that meet further seeds")
    final_seeds: int = Field(gt=0, description="seeds that no trial has met")
    space: dict[str, tuple[float, float, Annotated[float, Field(gt=0)]]] = Field(
        min_length=1, description="of each setting: lowest, highest, step"
    )

    @model_validator(mode="after")
    def _makes_sense(self) -> "SearchSettings":
        for name, (lowest, highest, _) in self.space.items():
            if name not in SHIPPED:
                raise ValueError(f'space: unknown setting "{name}"{nearest(name, SHIPPED)}')
            if lowest > highest:
                raise ValueError(f"space.{name}: expected the lowest value first")
        if self.seeds + self.final_seeds > len(VALIDATION_SEEDS):
            raise ValueError(f"there are only {len(VALIDATION_SEEDS)} validation seeds")
        return self


def train(options: Options) -> None:
    """Search until the trials are done or somebody stops it.

    Args:
        options: of the command; ``steps`` are trials.

    Raises:
        RightOfWayError: settings, scenarios or the folder make no sense.
    """
    settings = read_settings(
        SearchSettings,
        Path(__file__).with_name(f"{NAME}.toml"),
        options,
        {"scenarios": options.scenarios, "rates": options.rates, "trials": options.steps},
    )
    scenarios = catalogue.find_scenarios(settings.scenarios)
    folder = Folder(options, NAME, settings, checkpoint="trials.log")
    study = _study(folder.checkpoint)
    with working(options.workers) as workers, interrupts(options.notify) as stop:
        scorer = Scorer(settings, scenarios, workers)
        _try(study, scorer, options.seed, stop)
        folder.note(trials=len(study.trials))
        if len(study.trials) < settings.trials:
            options.notify(f"stopped; continue with --resume --out {folder.path}")
            raise KeyboardInterrupt
        final = {reference(chosen): scorer.final(chosen) for chosen in _finalists(study, settings)}
    best = min(final, key=final.__getitem__)
    folder.note(finished=True, final=final, best=best)
    options.notify(f"best on seeds that no trial has met: {best}")


def _study(file: Path) -> optuna.Study:
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    storage = JournalStorage(JournalFileBackend(str(file)))
    return optuna.create_study(storage=storage, study_name=NAME, load_if_exists=True)


def _try(study: optuna.Study, scorer: "Scorer", seed: int, stop: Interrupts) -> None:
    """Try settings, first those that ship. What is tried depends on the trials before alone."""
    settings = scorer.settings
    done = len(study.get_trials(deepcopy=False, states=[TrialState.COMPLETE]))
    with bar("trials") as display:
        task = display.add_task("", total=settings.trials, completed=done)
        for number in range(done, settings.trials):
            if stop.wanted:
                return
            study.sampler = TPESampler(seed=10_000 * seed + number, multivariate=True)
            if number == 0:
                study.enqueue_trial({name: SHIPPED[name] for name in settings.space})
            trial = study.ask()
            chosen = {name: _suggest(trial, name, *edges) for name, edges in settings.space.items()}
            study.tell(trial, scorer.score(chosen))
            display.update(task, advance=1, description=f"best score {study.best_value:.3f}")


def _suggest(trial: optuna.Trial, name: str, lowest: float, highest: float, step: float) -> float:
    if isinstance(SHIPPED[name], int):
        return trial.suggest_int(name, int(lowest), int(highest), step=int(step))
    return round(trial.suggest_float(name, lowest, highest, step=step), 6)


def _finalists(study: optuna.Study, settings: SearchSettings) -> list[Chosen]:
    """What ships, and the best trials."""
    trials = study.get_trials(deepcopy=False, states=[TrialState.COMPLETE])
    ranked = sorted(trials[1:], key=lambda trial: (trial.value, trial.number))
    return [trial.params for trial in (trials[0], *ranked[: settings.finalists])]


def reference(chosen: Chosen) -> str:
    """Time windows with these settings, as ``rightofway run --controller`` takes them."""
    return f"{NAME}?" + "&".join(f"{name}={value:g}" for name, value in sorted(chosen.items()))


class Scorer:
    """Scores settings: 1 is as good as the reference, less is better.

    A score is the mean over episodes of the mean of two ratios, average waiting time and travel
    time to those under the reference on the same scenario and seed, and of what collisions add.

    Args:
        settings: of the search.
        scenarios: to run on.
        workers: to run in.

    Raises:
        RightOfWayError: the reference cannot run everywhere.
    """

    def __init__(
        self, settings: SearchSettings, scenarios: Sequence[Scenario], workers: "ProcessPool"
    ) -> None:
        if plugins.load_class(settings.reference).needs_robot_vehicles:
            raise UsageError(f'reference: "{settings.reference}" needs RVs; choose a signal')
        self.settings = settings
        self._scenarios, self._workers = scenarios, workers
        seeds = VALIDATION_SEEDS[: settings.seeds + settings.final_seeds]
        self._seeds, self._final_seeds = seeds[: settings.seeds], seeds[settings.seeds :]
        chosen = all_episodes(scenarios, [settings.reference], [0.0], seeds)
        build_ahead(chosen)
        self._to_beat = {}
        for episode, record in zip(chosen, self._run(chosen), strict=True):
            if (figures := _figures(record)) is None:
                raise UsageError(
                    f"{settings.reference} fails on {episode.scenario.name}, seed {episode.seed}; "
                    "choose another reference"
                )
            self._to_beat[episode.scenario.name, episode.seed] = figures

    def score(self, chosen: Chosen) -> float:
        """Of settings, on the seeds of trials."""
        return self._score(chosen, self._seeds)

    def final(self, chosen: Chosen) -> float:
        """Of settings, on seeds that no trial has met."""
        return self._score(chosen, self._final_seeds)

    def _score(self, chosen: Chosen, seeds: Sequence[int]) -> float:
        name = reference(chosen)
        cells = product(self._scenarios, self.settings.rates, seeds)
        episodes = [Episode(scenario, name, rate, seed) for scenario, rate, seed in cells]
        played = zip(episodes, self._run(episodes), strict=True)
        return round(fmean(self._of(episode, record) for episode, record in played), 4)

    def _of(self, episode: Episode, record: Record | None) -> float:
        figures = _figures(record)
        if record is None or record.trips is None or figures is None:
            return FAILED
        to_beat = self._to_beat[episode.scenario.name, episode.seed]
        ratios = fmean(mine / max(other, 1.0) for mine, other in zip(figures, to_beat, strict=True))
        return min(FAILED, ratios + self.settings.collision * record.trips.collisions_with_robot)

    def _run(self, episodes: Sequence[Episode]) -> Iterator[Record | None]:
        futures: list[Future[Record]] = [
            self._workers.schedule(run_episode, args=(episode,), timeout=outcome.TIME_LIMIT)
            for episode in episodes
        ]
        for future in futures:
            yield None if future.exception() else future.result()


def _figures(record: Record | None) -> tuple[float, float] | None:
    """Average waiting time, mean over the junctions, and travel time [s]; None if it has none."""
    if record is None or record.status != "ok" or record.trips is None:
        return None
    waits = [junction.average_waiting_time or 0.0 for junction in record.junctions.values()]
    return (fmean(waits), record.trips.travel_time) if record.trips.travel_time else None

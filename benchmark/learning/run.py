"""A training run as its command sees it: options, settings, a folder with all that it leaves."""

import hashlib
import json
import os
import platform
import sys
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, TypeVar

from pydantic import BaseModel, Field, PositiveFloat, ValidationError

import benchmark
from benchmark.control.training import FIRST_TRAINING_SEED as FIRST_TRAINING_SEED
from benchmark.control.training import VALIDATION_SEEDS as VALIDATION_SEEDS
from benchmark.learning.traffic import GRIDLOCK_AFTER
from benchmark.plumbing import interrupts
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.messages import explain
from benchmark.plumbing.models import Share, Table
from benchmark.scenario.scenario import Scenario

if TYPE_CHECKING:
    import numpy as np
    from rich import progress

PACKAGES = (
    "eclipse-sumo",
    "numpy",
    "torch",
    "stable-baselines3",
    "gymnasium",
    "safetensors",
    "optuna",
)

Reference = Annotated[str, Field(min_length=1)]

Settings = TypeVar("Settings", bound=BaseModel)


@dataclass(frozen=True)
class Options:
    """What the command ``rightofway train`` was told."""

    out: Path
    scenarios: Sequence[str] | None = None  # references; None takes the settings'
    rates: Sequence[float] | None = None
    steps: int | None = None  # decisions of vehicles
    seed: int = 1
    workers: int = 1
    resume: bool = False
    changes: Sequence[str] = ()  # of settings, as in "reward.penalty=0.3"
    notify: Callable[[str], None] = print


Trainer = Callable[[Options], None]
"""What the entry-point group ``rightofway.trainers`` holds."""


class TrainingTraffic(Table):
    """The episodes that are learnt from."""

    scenarios: tuple[Reference, ...] = Field(
        description="shipped names, files or folders", min_length=1
    )
    rates: tuple[Share, ...] = Field(description="one is drawn for each episode", min_length=1)
    demand: tuple[PositiveFloat, ...] = Field(
        (1.0,), min_length=1, description="factors on the counts, one is drawn"
    )
    duration: float = Field(600.0, gt=0, description="[s]")
    seeds: int = Field(200, gt=0, description="how many different demands are drawn from")
    episodes: int = Field(4, gt=0, description="episodes of a round, the scenarios by turns")
    gridlock_after: float = Field(GRIDLOCK_AFTER, gt=0, description="[s] ends an episode early")


class Validation(Table):
    """The episodes that tell how good a policy is; never those of evaluation."""

    seeds: int = Field(2, gt=0, le=len(VALIDATION_SEEDS), description="from 1001 up")
    rates: tuple[Share, ...] = Field((0.4, 0.7, 1.0), min_length=1)
    rounds: int = Field(10, gt=0, description="rounds between two validations")
    gridlock: float = Field(300.0, description="[s] what a gridlocked episode counts as waiting")


def read_settings(
    kind: type[Settings], path: Path, options: Options, changes: Mapping[str, Any] | None = None
) -> Settings:
    """Settings from a TOML file, with the command's changes.

    Args:
        kind: the model.
        path: the file.
        options: of the command; ``changes`` of it are ``table.key=value`` with a TOML value.
        changes: further ones, by the same paths.

    Raises:
        UsageError: a change or the file makes no sense; the message names key and value.
    """
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    for change in options.changes:
        place, equals, text = change.partition("=")
        try:
            value = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError as error:
            raise UsageError(f'--set "{change}": expected table.key=value, as TOML') from error
        if not equals:
            raise UsageError(f'--set "{change}": expected table.key=value')
        _put(document, place.strip(), value)
    for place, value in (changes or {}).items():
        if value is not None:
            _put(document, place, value)
    try:
        return kind.model_validate_json(json.dumps(document, default=str))
    except ValidationError as error:
        raise UsageError(explain(error, kind, path.name)) from error


def _put(document: dict[str, Any], place: str, value: object) -> None:
    *tables, key = place.split(".")
    for table in tables:
        document = document.setdefault(table, {})
        if not isinstance(document, dict):
            raise UsageError(f'--set "{place}": "{table}" is not a table')
    document[key] = value


class Start(NamedTuple):
    """Which episode is to be played."""

    scenario: Scenario
    rate: float
    seed: int


def training_episodes(
    traffic: TrainingTraffic, scenarios: Sequence[Scenario], random: "np.random.Generator"
) -> Iterator[Start]:
    """A round's episodes: the scenarios by turns, rate, demand and seed drawn for each.

    Args:
        traffic: the settings.
        scenarios: as they are; their duration and demand are replaced.
        random: of the round.
    """
    for index in range(traffic.episodes):
        scenario = scenarios[index % len(scenarios)]
        evaluation = scenario.evaluation.model_copy(
            update={"duration": traffic.duration, "warm_up": 0.0}
        )
        scenario = scenario.with_demand(float(random.choice(traffic.demand)))
        yield Start(
            scenario.with_evaluation(evaluation),
            rate=float(random.choice(traffic.rates)),
            seed=FIRST_TRAINING_SEED + int(random.integers(traffic.seeds)),
        )


def validation_episodes(validation: Validation, scenarios: Sequence[Scenario]) -> Iterator[Start]:
    """The episodes of a validation, each scenario at full length."""
    for scenario in scenarios:
        for rate in validation.rates:
            for seed in VALIDATION_SEEDS[: validation.seeds]:
                yield Start(scenario, rate, seed)


@contextmanager
def bar(things: str) -> "Iterator[progress.Progress]":
    """A bar of progress.

    Args:
        things: what is counted, in the plural.
    """
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn("{task.completed:,}/{task.total:,} " + things),
        progress.BarColumn(),
        progress.TimeElapsedColumn(),
        progress.TextColumn("left"),
        progress.TimeRemainingColumn(),
        progress.TextColumn("{task.description}"),
    )
    with progress.Progress(*columns, console=Console(stderr=True)) as shown:
        yield shown


class Folder:
    """Where a run keeps what it leaves: manifest, checkpoint, logs, weights.

    Args:
        options: ``out`` is the folder.
        name: of what is trained.
        settings: all of the run's settings.
        checkpoint: name of the file that a run resumes from.

    Raises:
        UsageError: there is a run already and ``resume`` was not asked for, or the other way
            round, or the run there has other settings.
    """

    def __init__(
        self, options: Options, name: str, settings: BaseModel, checkpoint: str = "checkpoint.pt"
    ) -> None:
        self.path = options.out
        self.checkpoint = self.path / checkpoint
        self._began = time.perf_counter()
        self._spent = 0.0
        plain = settings.model_dump(mode="json")
        self._manifest: dict[str, Any] = {
            "name": name,
            "settings": plain,
            "seed": options.seed,
            "command": ["rightofway", *sys.argv[1:]],
            "code": code_hash(),
            "versions": _versions(),
        }
        manifest = self.path / "manifest.json"
        if options.resume:
            self._continue(manifest)
        elif self.checkpoint.exists() or _is_finished(manifest):
            raise UsageError(
                f"{self.path}: holds a training run; continue it with --resume, or give "
                "another --out"
            )
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self.note()
        except OSError as error:
            raise UsageError(
                f"{self.path}: cannot write there: {error.strerror}; give another --out"
            ) from error

    def _continue(self, manifest: Path) -> None:
        if not _is_finished(manifest) and not (manifest.is_file() and self.checkpoint.is_file()):
            raise UsageError(f"{self.path}: no training run to resume; leave out --resume")
        try:
            held = json.loads(manifest.read_text(encoding="utf-8"))
            self._spent = float(held["wall_time"])
        except (KeyError, TypeError, ValueError) as error:
            raise UsageError(f"{manifest}: damaged; start anew with another --out") from error
        if held.get("finished"):
            raise UsageError(f"{self.path}: the training run there is finished")
        for key in ("name", "settings", "seed", "code", "versions"):
            if held.get(key) != self._manifest[key]:
                raise UsageError(
                    f"{self.path}: was made with another {key}; a run resumes only unchanged: "
                    f"{_difference(held.get(key), self._manifest[key])}"
                )
        self._manifest["command"] = held.get("command")

    def note(self, **facts: object) -> None:
        """Write the manifest, with further facts."""
        self._manifest |= facts
        self._manifest["wall_time"] = round(self._spent + time.perf_counter() - self._began, 1)
        with replaced(self.path / "manifest.json") as file:
            file.write_text(json.dumps(self._manifest, indent=2) + "\n", encoding="utf-8")

    @property
    def manifest(self) -> Mapping[str, Any]:
        """What the manifest says."""
        return self._manifest


def _is_finished(manifest: Path) -> bool:
    """Whether a run's manifest says that it has ended; one that cannot be read may have."""
    if not manifest.is_file():
        return False
    try:
        return bool(json.loads(manifest.read_text(encoding="utf-8")).get("finished"))
    except (ValueError, AttributeError):
        return True


def _difference(held: object, given: object) -> str:
    if isinstance(held, dict) and isinstance(given, dict):
        for key in sorted(held.keys() | given.keys()):
            if held.get(key) != given.get(key):
                return f"{key}: {_difference(held.get(key), given.get(key))}"
    return f"{held} there, {given} now"


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A file to be written beside the one it takes the place of, all or nothing."""
    beside = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        yield beside
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def code_hash() -> str:
    """SHA-256 of the benchmark's own source: what an edited tree tells from a version."""
    root = Path(benchmark.__file__).parents[1]
    found = hashlib.sha256()
    for package in ("benchmark", "baselines"):
        for path in sorted((root / package).rglob("*.py")):
            found.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def _versions() -> dict[str, str]:
    found = {"rightofway": benchmark.__version__, "python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found


class Interrupts(interrupts.Interrupts):
    """Lets the round end after the first Ctrl-C, and says so."""

    def __init__(self, notify: Callable[[str], None]) -> None:
        words = "stopping after this round; Ctrl-C again stops at once and loses it"
        super().__init__(lambda: notify(words))

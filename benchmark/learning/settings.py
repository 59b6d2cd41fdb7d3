"""Settings of a training run: what its command says, and the tables of its TOML file."""

import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, Field, PositiveFloat, ValidationError

from benchmark.control.training import VALIDATION_SEEDS
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.messages import explain
from benchmark.plumbing.models import Share, Table
from benchmark.world.gridlock import GRIDLOCK_AFTER

Reference = Annotated[str, Field(min_length=1)]

Model = TypeVar("Model", bound=BaseModel)


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
    kind: type[Model], path: Path, options: Options, changes: Mapping[str, Any] | None = None
) -> Model:
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

"""Suites declared in TOML files: which controllers meet which scenarios, rates and seeds."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, PositiveInt, PrivateAttr, ValidationError

from benchmark.control import reference
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import declaration_of
from benchmark.plumbing import confined, toml_file
from benchmark.plumbing.errors import ControllerError, RightOfWayError, SuiteError, UsageError
from benchmark.plumbing.messages import explain
from benchmark.plumbing.models import Share, Table
from benchmark.scenario import catalogue
from benchmark.scenario.evaluation import MOST_SEEDS
from benchmark.scenario.scenario import Scenario

OWN_KEYS = frozenset({"controllers", "scenarios"})  # by which a suite is told from a scenario
FOLDER = Path(__file__).parent / "suites"

Reference = Annotated[str, Field(min_length=1)]


def _reference_of(given: Any) -> Any:
    """A controller given as a table, as the reference that it stands for."""
    if not isinstance(given, dict):
        return given
    try:
        return reference.from_table(given)
    except ControllerError as error:
        raise ValueError(str(error)) from error


ControllerReference = Annotated[Reference, BeforeValidator(_reference_of)]


class Suite(Table):
    """A declared study: every controller meets the same scenarios, rates and seeds."""

    scenarios: tuple[Reference, ...] = Field(
        min_length=1, description="Files and folders beside the suite's file, or shipped names."
    )
    controllers: tuple[ControllerReference, ...] = Field(
        min_length=1,
        description='As in "virtual-signal?green=15" or { name = "virtual-signal", green = 15 }; '
        "files lie beside the suite's file.",
    )
    rates: tuple[Share, ...] | None = Field(
        None, min_length=1, description="Penetration rates; default: each scenario's."
    )
    seeds: PositiveInt | None = Field(
        None,
        le=MOST_SEEDS,
        description="The suite uses the seeds 1 to this number; default: each scenario's.",
    )

    _path: Path = PrivateAttr(default=Path())

    def load_scenarios(self) -> list[Scenario]:
        """The scenarios, those that lie beside the suite's file before shipped ones.

        Raises:
            SuiteError: a reference leads nowhere, or to a file that is no valid scenario.
        """
        references = [_placed(scenario, self._path.parent) for scenario in self.scenarios]
        try:
            return catalogue.find_scenarios(references)
        except RightOfWayError as error:
            raise SuiteError(f"{self._path}: scenarios: {error}") from error

    def checked_controllers(
        self, isolate: bool | None = None, limits: Limits = DEFAULT
    ) -> list[str]:
        """The controllers, every one of which is there and takes its options.

        Args:
            isolate: whether they are imported in processes of their own; None: what is not
                installed is.
            limits: of time and memory where they are.

        Raises:
            SuiteError: one of them is not, or does not.
        """
        references = []
        for index, controller in enumerate(self.controllers):
            try:
                own = _confined(controller, self._path.parent)
                declaration = declaration_of(own, isolate, limits, self._path.parent)
            except RightOfWayError as error:
                raise SuiteError(f"{self._path}: controllers[{index}]: {error}") from error
            references.append(declaration.reference)
        return references


def _confined(controller: str, folder: Path) -> str:
    """A controller's reference, whose options name no file but those in the suite's folder.

    Whoever wrote the suite may be a stranger to whoever runs it.

    Raises:
        ControllerError: one does.
    """
    parts = reference.parse(controller)
    options = parts.options()
    for key, value in options.items():
        elsewhere = Path(value).absolute()
        inside = (folder / value).absolute()
        if confined.may_lead_out(value) or (elsewhere != inside and _is_there(elsewhere)):
            raise ControllerError(
                f"{key}: {value} leads out of the suite's folder; put the file beside the suite, "
                "or give the controller with --controller"
            )
        if elsewhere != inside and _is_there(inside):
            options[key] = str(inside)
    return str(replace(parts, query=reference.query(options)))


def _is_there(path: Path) -> bool:
    """Whether there is something of that name, which may be too long for one."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _placed(scenario: str, folder: Path) -> str:
    """A scenario's reference as seen from anywhere: files and folders lie beside the suite."""
    place, at, _ = scenario.rpartition("@")
    candidates = [folder / scenario, *([folder / place] if at else [])]
    own = candidates[-1].suffix == ".toml" or any(path.exists() for path in candidates)
    return str(folder / scenario) if own else scenario


def shipped_suites() -> dict[str, Path]:
    """The shipped suites by name, as in ``paper``."""
    return {path.stem: path for path in sorted(FOLDER.glob("*.toml"))}


def find_suite(references: Sequence[str]) -> Suite | None:
    """The suite that references name; None where they all name scenarios.

    Args:
        references: files of suites or scenarios, shipped suites' names, or whatever
            ``benchmark.scenario.catalogue.find_scenarios`` knows.

    Raises:
        SuiteError: the suite is not valid.
        UsageError: it does not stand alone.
    """
    for name in references:
        if (path := _path(name)) is not None:
            if len(references) > 1:
                raise UsageError(
                    f'"{name}" is a suite and names its scenarios itself; give it alone'
                )
            return load_suite(path)
    return None


def _path(name: str) -> Path | None:
    """Where the suite of that name is; a folder of the user's scenarios comes before it."""
    path = Path(name)
    if _declares_suite(path):
        return path
    declared = shipped_suites().get(name)
    return None if declared and any(path.rglob("*.toml")) else declared


def _declares_suite(path: Path) -> bool:
    try:
        return not OWN_KEYS.isdisjoint(toml_file.read(path, SuiteError))
    except SuiteError:
        return False  # whoever reads it as a scenario says what is wrong


def load_suite(path: Path) -> Suite:
    """Read and validate a suite's file.

    Raises:
        SuiteError: the file is missing, not TOML, or not a valid suite; the message names the
            file, the key's path, the value, what was expected.
    """
    document = toml_file.read(path, SuiteError)
    try:  # by way of JSON, whose lists are tuples; no key takes a date
        suite = Suite.model_validate_json(json.dumps(document, default=str))
    except ValidationError as error:
        raise SuiteError(explain(error, Suite, str(path))) from error
    suite._path = path
    return suite

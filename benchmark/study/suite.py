"""Suites declared in TOML files: which controllers meet which scenarios, rates and seeds."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, PositiveInt, PrivateAttr, ValidationError

from benchmark.control import reference
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import look
from benchmark.plumbing import toml_file
from benchmark.plumbing.errors import ControllerError, RightOfWayError, SuiteError, UsageError
from benchmark.plumbing.messages import explain
from benchmark.plumbing.models import Share, Table
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario

OWN_KEYS = frozenset({"controllers", "scenarios"})  # by which a suite is told from a scenario
FOLDER = Path(__file__).parent / "suites"

Reference = Annotated[str, Field(min_length=1)]


def _in_words(given: Any) -> Any:
    """A controller given as a table, as the reference that it stands for."""
    if not isinstance(given, dict):
        return given
    try:
        return reference.from_table(given)
    except ControllerError as error:
        raise ValueError(str(error)) from error


ControllerReference = Annotated[Reference, BeforeValidator(_in_words)]


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
        None, description="The suite uses the seeds 1 to this number; default: each scenario's."
    )

    _path: Path = PrivateAttr(default=Path())

    def load_scenarios(self) -> list[Scenario]:
        """The scenarios, those that lie beside the suite's file before shipped ones.

        Raises:
            SuiteError: a reference leads nowhere, or to a file that is no valid scenario.
        """
        references = [_placed(one, self._path.parent) for one in self.scenarios]
        try:
            return catalogue.find(references)
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
        found = []
        for index, one in enumerate(self.controllers):
            try:
                found.append(look(one, isolate, limits, self._path.parent).reference)
            except RightOfWayError as error:
                raise SuiteError(f"{self._path}: controllers[{index}]: {error}") from error
        return found


def _placed(scenario: str, folder: Path) -> str:
    """A scenario's reference as seen from anywhere: files and folders lie beside the suite."""
    place, at, _ = scenario.rpartition("@")
    candidates = [folder / scenario, *([folder / place] if at else [])]
    own = candidates[-1].suffix == ".toml" or any(one.exists() for one in candidates)
    return str(folder / scenario) if own else scenario


def shipped() -> dict[str, Path]:
    """The shipped suites by name, as in ``paper``."""
    return {path.stem: path for path in sorted(FOLDER.glob("*.toml"))}


def find(references: Sequence[str]) -> Suite | None:
    """The suite that references name; None where they all name scenarios.

    Args:
        references: files of suites or scenarios, shipped suites' names, or whatever
            ``benchmark.scenario.catalogue.find`` knows.

    Raises:
        SuiteError: the suite is not valid.
        UsageError: it does not stand alone.
    """
    found = {one: path for one in references if (path := _path(one)) is not None}
    if found and len(references) > 1:
        raise UsageError(
            f'"{next(iter(found))}" is a suite and names its scenarios itself; give it alone'
        )
    return load(next(iter(found.values()))) if found else None


def _path(name: str) -> Path | None:
    """Where the suite of that name is; a folder of the user's scenarios comes before it."""
    path = Path(name)
    if name in shipped() and not any(path.rglob("*.toml")):
        return path if _declares_suite(path) else shipped()[name]
    return path if _declares_suite(path) else None


def _declares_suite(path: Path) -> bool:
    try:
        return not OWN_KEYS.isdisjoint(toml_file.read(path, SuiteError))
    except SuiteError:
        return False  # whoever reads it as a scenario says what is wrong


def load(path: Path) -> Suite:
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

"""Checks made one by one, for pytest, or all at once."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from benchmark.admission.conformance.checks import CHECKS, ONCE, applies
from benchmark.admission.conformance.result import (
    CheckFailedError,
    CheckSkippedError,
    Result,
    Status,
)
from benchmark.admission.conformance.subject import Subject
from benchmark.control.controller import Controller
from benchmark.control.guard import ControllerFailedError
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario

SMOKE = ("smoke",)


@dataclass(frozen=True)
class Case:
    """One check on one scenario; as text, such as ``forgets-smoke/tee``, it is a test's id."""

    check: str
    subject: Subject
    scenario: Scenario

    def __str__(self) -> str:
        return self.check if self.check in ONCE else f"{self.check}-{self.scenario.name}"

    def run(self) -> Result:
        """Make the check.

        Raises:
            RightOfWayError: the controller cannot be found, or the scenario cannot be run.
        """
        where = "" if self.check in ONCE else self.scenario.name
        status: Status = "passed"
        try:
            applies(self.check, self.subject, self.scenario)
            words = CHECKS[self.check](self.subject, self.scenario)
        except CheckSkippedError as reason:
            status, words = "skipped", str(reason)
        except (CheckFailedError, ControllerFailedError) as fault:
            status, words = "failed", str(fault)
        return Result(self.check, where, status, words)

    def verify(self) -> None:
        """Make the check in pytest, where it fails or is skipped with its reason.

        Raises:
            AssertionError: the check failed.
        """
        import pytest

        result = self.run()
        if result.status == "skipped":
            pytest.skip(result.words)
        if result.status == "failed":
            raise AssertionError(result.words)


def conformance_cases(
    controller: str | type[Controller], scenarios: Iterable[str] = SMOKE
) -> Sequence[Case]:
    """The checks of a controller, to be made one by one; episodes are shared between them.

    Args:
        controller: a reference, as in ``my-controller?horizon=5`` or ``my_file.py:MyController``,
            or a class.
        scenarios: as ``benchmark.scenario.catalogue.find_scenarios`` reads them.

    Raises:
        ScenarioError: a scenario is not there.
    """
    found = catalogue.find_scenarios(scenarios)
    subject = Subject(controller, found)
    return [
        Case(check, subject, scenario)
        for check in CHECKS
        for scenario in (found[:1] if check in ONCE else found)
    ]


def check_controller(
    controller: str | type[Controller], scenarios: Iterable[str] = SMOKE
) -> list[Result]:
    """Make all checks.

    Args:
        controller: as ``cases`` has it.
        scenarios: as ``cases`` has them.

    Raises:
        RightOfWayError: the controller or a scenario cannot be found or run.
    """
    return [case.run() for case in conformance_cases(controller, scenarios)]

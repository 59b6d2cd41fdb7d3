"""``rightofway check isolation``: what isolation keeps out on this system, found by trying."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from factories.command_line import rightofway

from benchmark.control.guard import ControllerFailedError
from benchmark.control.isolation import probe
from benchmark.control.isolation.attempts import PROTECTIONS, THROUGH
from benchmark.control.isolation.probe import Verdict


def verdicts(**outcomes: str) -> list[Verdict]:
    """Every attempt refused but those named."""
    return [
        Verdict(
            protection,
            {name: outcomes.get(name, "EPERM") for name in protection.attempts},
        )
        for protection in PROTECTIONS
    ]


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[Any], Any]:
    """The command where trying comes to this."""

    def run(found: Any) -> Any:
        monkeypatch.setattr(probe, "probe", found)
        return rightofway(tmp_path, "check", "isolation")

    return run


def test_every_protection_is_a_line_with_its_verdict_and_what_it_needs(
    told: Callable[[Any], Any],
) -> None:
    done = told(verdicts)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"{len(PROTECTIONS)} held, 0 open" in done.stdout
    assert done.stdout.count("│ held ") == len(PROTECTIONS)


def test_what_gets_through_is_named_and_is_exit_code_1(told: Callable[[Any], Any]) -> None:
    done = told(lambda: verdicts(stat=THROUGH, chroot=THROUGH))
    assert done.returncode == 1
    assert f"{len(PROTECTIONS) - 2} held, 2 open" in done.stdout
    for words in ("got through: stat", "got through: chroot"):
        assert words in done.stdout


def test_a_process_that_cannot_be_asked_is_an_error(told: Callable[[Any], Any]) -> None:
    def fail() -> list[Verdict]:
        raise ControllerFailedError("attempts: no answer within 20 s", "timed out")

    done = told(fail)
    assert done.returncode == 2
    assert "isolation cannot be tried: attempts: no answer within 20 s" in done.stderr


def test_scenarios_have_no_place_in_it(tmp_path: Path) -> None:
    done = rightofway(tmp_path, "check", "isolation", "--scenario", "tee")
    assert done.returncode == 2
    assert "not with `check isolation`" in done.stderr

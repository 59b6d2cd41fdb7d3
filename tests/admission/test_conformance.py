"""The conformance kit: each broken promise is found, by the check that is for it and no other."""

import itertools
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from factories.scenarios import ROOT, smoke
from plugins import install

from benchmark.admission.conformance import (
    Result,
    check_controller,
    conformance_cases,
    elsewhere,
    subject,
    watching,
)
from benchmark.admission.conformance.checks import CHECKS, ONCE
from benchmark.admission.conformance.elsewhere import Task, Trial
from benchmark.control import plugins
from benchmark.plumbing.errors import ControllerError, ScenarioError

UNRULY = ROOT / "tests" / "plugins" / "unruly.py"
BOTH = ("smoke/tee", "smoke/crossing")


def at_once(tasks: Sequence[Task]) -> list[Trial]:
    """Episodes for a process of their own, run in this one."""
    return [elsewhere.run_one(one) for one in tasks]


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """For checks that do not depend on the process."""
    monkeypatch.setattr(elsewhere, "run_elsewhere", at_once)


def checked(name: str, scenarios: Sequence[str] = BOTH) -> list[Result]:
    return check_controller(f"{UNRULY}:{name}", scenarios)


def failures(results: Sequence[Result]) -> dict[str, str]:
    return {one.check: one.words for one in results if one.status == "failed"}


@pytest.mark.usefixtures("here")
def test_a_controller_that_keeps_to_the_contract_passes_every_check_on_every_scenario() -> None:
    results = checked("Tame")
    assert {one.status for one in results} == {"passed"}
    wanted = [(check, where) for check in CHECKS for where in ([""] if check in ONCE else BOTH)]
    assert [(one.check, one.scenario) for one in results] == wanted
    (timing, _) = (one.words for one in results if one.check == "decides-in-time")
    assert timing.startswith("mean 0.")
    assert "vehicles in the zone" in timing


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("name", "check", "words"),
    [
        ("Nameless", "declares", "the class has no docstring"),
        ("Commands", "legal", "Stop refused: the vehicle is not in the decision zone ("),
        ("Scribbles", "reads-only", "act changed note of the state at 1 s; what it is given is"),
        ("Forges", "reads-only", "act changed vehicles of the state at "),
        ("Moves", "reads-only", "act changed a fact of the intersection"),
        ("Remembers", "forgets", "Stop() from the same object, used for other episodes before"),
        ("Trips", "forgets", "it raised KeyError: 'westbound_2' (unruly.py:"),
        ("Shares", "shares-nothing", "an object beside which another one was used; keep nothing"),
    ],
)
def test_a_broken_promise_fails_the_check_that_is_for_it(name: str, check: str, words: str) -> None:
    found = failures(checked(name, BOTH if check == "forgets" else BOTH[:1]))
    assert list(found) == [check]
    assert words in found[check]


@pytest.mark.usefixtures("here")
def test_dice_of_its_own_are_no_repetition() -> None:
    found = failures(checked("Dices"))
    assert {"repeats", "forgets"} <= set(found) <= {name for name in CHECKS if name not in ONCE}
    assert "s it commanded " in found["repeats"]
    assert "draw randomness from the seed given to reset" in found["repeats"]


@pytest.mark.usefixtures("here")
def test_what_cannot_be_made_fails_once_and_says_where() -> None:
    results = checked("Unmakeable")
    found = failures(results)
    assert set(found) == {"declares", "runs"}
    assert "its constructor raised FileNotFoundError: " in found["declares"]
    assert "(unruly.py:" in found["declares"]
    rest = {one.words for one in results if one.check not in ("declares", "runs")}
    assert rest == {"it does not get through an episode; see runs"}


@pytest.mark.usefixtures("here")
def test_a_decision_that_takes_longer_than_a_step_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = itertools.count(0.0, 1.5)
    monkeypatch.setattr(watching.clock, "perf_counter", lambda: next(ticks))
    found = failures(checked("Tame", BOTH[:1]))
    assert list(found) == ["decides-in-time"]
    assert found["decides-in-time"].startswith("mean 1500.000 ms, p99 1500.000 ms with ")
    assert found["decides-in-time"].endswith("; a step is 1000 ms")


@pytest.mark.usefixtures("here")
def test_where_its_needs_are_not_met_it_is_skipped_and_elsewhere_checked_within_its_rates() -> None:
    results = checked("FourOnly")
    by_place = {where: {r.status for r in results if r.scenario == where} for where in BOTH}
    assert by_place == {"smoke/tee": {"skipped"}, "smoke/crossing": {"passed"}}
    words = {one.check: one.words for one in results if one.scenario != "smoke/tee"}
    assert words["declares"] == "lights dark, flexible arbitration; 60 to 90 % RVs; 4 approaches"
    assert words["runs"] == "episodes at 60 % RVs, at 90 % RVs"
    assert {one.words for one in results if one.status == "skipped"} == {
        "it needs 4 approaches, and the scenario has 3"
    }


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("name", "reason"), [("FourOnly", "it needs 4 approaches"), ("Picky", "smoke/tee bores it")]
)
def test_to_be_skipped_everywhere_is_no_success(name: str, reason: str) -> None:
    found = failures(checked(name, BOTH[:1]))
    assert list(found) == ["declares"]
    assert (
        f"none of the scenarios suits it, so nothing can be checked (smoke/tee: {reason}"
        in (found["declares"])
    )


def test_the_order_of_sets_shows_in_another_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject.Subject, "rates", [0.5])
    found = failures(checked("Hashes", BOTH[1:]))
    assert list(found) == ["repeats-elsewhere"]
    assert "sort what you iterate over, sets above all" in found["repeats-elsewhere"]


UNRULY_ONES = ("Tame", "Peeks", "Foresees", "Calls")


@pytest.fixture(scope="module")
def trials() -> dict[str, Trial]:
    """Episodes in other processes: of our controllers, then of those that reach out, as the
    reaches of a process add up.
    """
    rates = {
        name: 0.5 if plugins.load_class(name).needs_robot_vehicles else None
        for name in sorted(plugins.discovered())
    } | {f"{UNRULY}:{name}": 0.5 for name in UNRULY_ONES}
    tasks = [Task(name, smoke("crossing"), rate, 1) for name, rate in rates.items()]
    return dict(zip(rates, elsewhere.run_elsewhere(tasks), strict=True))


def test_reaching_beyond_the_contract_is_told_with_its_line(trials: dict[str, Trial]) -> None:
    deeds = {
        "        import libsumo": "imports libsumo",
        "import_module(": "imports benchmark.sumo.demand",
        "connect_ex(": "connects to the network",
    }
    lines = UNRULY.read_text().splitlines()
    told = {
        f"unruly.py:{1 + next(i for i, line in enumerate(lines) if code in line)} {deed}"
        for code, deed in deeds.items()
    }
    found = [trials[f"{UNRULY}:{name}"] for name in UNRULY_ONES]
    assert {line for one in found for line in one.reaches} == told


def test_no_installed_controller_reaches_beyond_the_contract(trials: dict[str, Trial]) -> None:
    found = {name: trials[name] for name in plugins.discovered()}
    assert {(one.failure, one.reaches) for one in found.values()} == {(None, ())}


def test_a_crash_or_a_hang_costs_the_checks_and_not_the_kit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(install(tmp_path))
    monkeypatch.setattr(subject.Subject, "rates", [0.5])
    found = failures(check_controller("hostile:Crashes", BOTH[:1]))
    assert list(found) == ["runs"]
    assert found["runs"].startswith("at 50 % RVs: its process died (-")
    monkeypatch.setattr(elsewhere, "TIME_LIMIT", 0.5)
    results = check_controller("hostile:Hangs", BOTH[:1])
    assert failures(results) == {
        "runs": "at 50 % RVs: the episode was not done after 0.5 s; do reset and act always return?"
    }
    assert {one.status for one in results if one.check == "forgets"} == {"skipped"}


@pytest.mark.usefixtures("here")
def test_cases_are_told_apart_by_id_and_fail_or_skip_with_the_reason() -> None:
    from plugins import unruly

    found = {str(case): case for case in conformance_cases(unruly.FourOnly, BOTH)}
    assert len(found) == len(conformance_cases(unruly.FourOnly, BOTH)) == len(ONCE) + 2 * 8
    found["forgets-smoke/crossing"].verify()
    with pytest.raises(pytest.skip.Exception, match="it needs 4 approaches"):
        found["forgets-smoke/tee"].verify()
    bad = {str(case): case for case in conformance_cases(unruly.Nameless, BOTH)}
    with pytest.raises(AssertionError, match="the class has no docstring"):
        bad["declares"].verify()


def test_the_documentation_has_every_check_in_its_order() -> None:
    text = (ROOT / "docs" / "conformance.md").read_text()
    assert re.findall(r"^\| `([a-z-]+)` \|", text, re.MULTILINE) == list(CHECKS)


def test_misuse_is_refused() -> None:
    with pytest.raises(ControllerError, match='did you mean "first-come"'):
        check_controller("frst-come")
    with pytest.raises(ScenarioError, match='did you mean "smoke/tee"'):
        conformance_cases("first-come", ["smoke/te"])

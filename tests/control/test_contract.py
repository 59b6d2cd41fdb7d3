"""What every installed controller keeps to, and what it can rely on, on every smoke scenario."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import libsumo
import pytest
from factories.episodes import live, mutable
from factories.scenarios import SMOKE, network_of

from benchmark.admission import conformance
from benchmark.admission.conformance import elsewhere
from benchmark.control import plugins
from benchmark.control.controller import Controller
from benchmark.control.state import TrafficState

CONTROLLERS = sorted(plugins.discovered())


every_pair = pytest.mark.parametrize(
    ("scenario", "name"), [(one, name) for one in SMOKE for name in CONTROLLERS]
)


def seen(scenario: str, name: str) -> list[TrafficState]:
    record, states, _ = live(scenario, name)
    if record.status == "skipped":
        pytest.skip(record.reason or "")
    return states


def cases(*scenarios: str, marks: Sequence[pytest.MarkDecorator] = ()) -> list[Any]:
    return [
        pytest.param(case, id=f"{name}-{case}", marks=marks)
        for name in CONTROLLERS
        for case in conformance.conformance_cases(name, scenarios)
        if case.check not in ("reaches", "repeats-elsewhere")
    ]


@pytest.mark.parametrize(
    "case", [*cases("smoke/asymmetric"), *cases(*SMOKE, marks=[pytest.mark.slow])]
)
def test_every_installed_controller_conforms(
    case: conformance.Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All in this process: test_conformance and test_determinism run them in others."""
    monkeypatch.setattr(
        elsewhere, "run_elsewhere", lambda tasks: [elsewhere.run_one(one) for one in tasks]
    )
    case.verify()


@every_pair
def test_a_controller_runs_or_says_why_not_and_vehicles_arrive(scenario: str, name: str) -> None:
    record, _, _ = live(scenario, name)
    if record.status == "skipped":
        assert record.reason
        return
    assert (record.status, record.reason) == ("ok", None)
    assert record.trips is not None
    assert record.trips.arrived > 0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_controller_describes_itself_and_is_made_without_arguments(name: str) -> None:
    kind = plugins.load_class(name)
    assert isinstance(kind(), Controller)
    assert plugins.description(kind).endswith(".")
    assert plugins.description(kind) != plugins.description(Controller)
    assert plugins.provenance(name) != "unknown"


@every_pair
def test_nothing_that_a_controller_receives_can_be_changed(scenario: str, name: str) -> None:
    states = seen(scenario, name)
    known: set[int] = set()
    found = [one for state in states[::20] for one in mutable(state, "state", known)]
    assert not found  # and so nothing leads to libsumo either
    assert len(known) > 100


def test_the_search_for_mutable_things_finds_them() -> None:
    state = TrafficState(network_of(SMOKE[0]).junctions["intersection"].intersection, 0.0, (), ())
    bad = dataclasses.replace(state, phase=([], libsumo))  # type: ignore[arg-type]
    assert list(mutable(bad, "state", set())) == ["state.phase[0]: list", "state.phase[1]: module"]

"""What every installed controller keeps to, and what it can rely on, on every smoke scenario."""

import dataclasses
import inspect
from collections.abc import Callable, Iterator, Mapping
from functools import cache, cached_property
from types import MappingProxyType, NoneType
from typing import Any

import libsumo
import pytest
from factories import SMOKE, network_of, shipped

from benchmark.admission import conformance
from benchmark.admission.conformance import elsewhere
from benchmark.control import plugins
from benchmark.control.controller import Command, Controller
from benchmark.control.state import TrafficState
from benchmark.records.record import Record
from benchmark.study.episode import Episode, run

CONTROLLERS = sorted(plugins.discovered())
SEED = 5

Given = list[list[tuple[str, Command]]]
"""What a controller commanded, step by step."""

every_pair = pytest.mark.parametrize(
    ("scenario", "name"), [(one, name) for one in SMOKE for name in CONTROLLERS]
)


def watched(
    episode: Episode, look: Callable[[TrafficState], None] = lambda state: None
) -> tuple[Record, list[TrafficState], Given]:
    """Run an episode and keep what its controller saw and commanded."""
    kind = plugins.load(episode.controller)
    states: list[TrafficState] = []
    given: Given = []

    def act(self: Controller, state: TrafficState) -> Mapping[str, Command]:
        commands = kind.act(self, state)
        look(state)
        states.append(state)
        given.append(list(commands.items()))
        return commands

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plugins, "load", lambda name: type(kind.__name__, (kind,), {"act": act}))
        return run(episode), states, given


@cache
def live(scenario: str, name: str) -> tuple[Record, list[TrafficState], Given]:
    """An episode of a pair, once per process."""
    rate = 0.5 if plugins.load(name).needs_robot_vehicles else None
    return watched(Episode(shipped(scenario), name, rate, SEED))


def seen(scenario: str, name: str) -> list[TrafficState]:
    record, states, _ = live(scenario, name)
    if record.status == "skipped":
        pytest.skip(record.reason or "")
    return states


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=f"{name}-{case}")
        for name in CONTROLLERS
        for case in conformance.cases(name)
        if case.check not in ("reaches", "repeats-elsewhere")
    ],
)
def test_every_installed_controller_conforms(
    case: conformance.Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All in this process: test_conformance and test_determinism run them in others."""
    monkeypatch.setattr(elsewhere, "run", lambda tasks: [elsewhere.run_one(one) for one in tasks])
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
    kind = plugins.load(name)
    assert isinstance(kind(), Controller)
    assert plugins.description(kind).endswith(".")
    assert plugins.description(kind) != plugins.description(Controller)
    assert plugins.provenance(name) != "unknown"


# --- what a controller receives ----------------------------------------------------------------


def mutable(thing: Any, path: str, known: set[int]) -> Iterator[str]:
    """Paths to whatever can be reached from a thing and is not known to be immutable."""
    if id(thing) in known or isinstance(thing, str | int | float | NoneType):
        return
    known.add(id(thing))
    if isinstance(thing, MappingProxyType):
        inner = {f"[{key!r}]": value for key, value in thing.items()}
    elif isinstance(thing, tuple | frozenset):
        inner = {f"[{index}]": value for index, value in enumerate(thing)}
    elif dataclasses.is_dataclass(thing) and type(thing).__dataclass_params__.frozen:
        lazy = inspect.getmembers_static(type(thing), lambda m: isinstance(m, LAZY))
        names = [field.name for field in dataclasses.fields(thing)] + [name for name, _ in lazy]
        inner = {f".{name}": getattr(thing, name) for name in names}
    else:
        yield f"{path}: {type(thing).__name__}"
        return
    for step, value in inner.items():
        yield from mutable(value, path + step, known)


LAZY = (property, cached_property)


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

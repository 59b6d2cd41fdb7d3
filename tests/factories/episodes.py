"""Episodes to run, watched from inside, and their records as lines."""

import dataclasses
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, cached_property
from types import MappingProxyType, NoneType
from typing import Any

import pytest

from benchmark.control import plugins
from benchmark.control.controller import Command, Controller
from benchmark.control.state import TrafficState
from benchmark.records.record import Record
from benchmark.study.episode import Episode, run_episode
from factories.scenarios import shipped, smoke

GOOD = [Episode(smoke("crossing"), "virtual-signal", 0.5, seed) for seed in range(1, 5)]
CROSSING = Episode(smoke("crossing"), "virtual-signal", 0.5, 1)
WITH_LIGHTS = dataclasses.replace(CROSSING, controller="traffic-light", rate=None)


def lines(records: Iterable[Record]) -> dict[str, str]:
    """Records as the store writes them, by episode, without the wall time."""
    return {repr(one.episode): one.model_copy(update={"wall_time": 0.0}).line() for one in records}


SEED = 5
Given = list[list[tuple[str, Command]]]
"""What a controller commanded, step by step."""


def watched(
    episode: Episode, look: Callable[[TrafficState], None] = lambda state: None
) -> tuple[Record, list[TrafficState], Given]:
    """Run an episode and keep what its controller saw and commanded."""
    kind = plugins.load_class(episode.controller)
    states: list[TrafficState] = []
    given: Given = []

    def act(self: Controller, state: TrafficState) -> Mapping[str, Command]:
        commands = kind.act(self, state)
        look(state)
        states.append(state)
        given.append(list(commands.items()))
        return commands

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            plugins, "load_class", lambda name: type(kind.__name__, (kind,), {"act": act})
        )
        return run_episode(episode), states, given


@cache
def live(scenario: str, name: str) -> tuple[Record, list[TrafficState], Given]:
    """An episode of a pair, once per process."""
    rate = 0.5 if plugins.load_class(name).needs_robot_vehicles else None
    return watched(Episode(shipped(scenario), name, rate, SEED))


LAZY = (property, cached_property)


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

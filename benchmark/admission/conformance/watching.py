"""Episodes whose controller is watched: what it saw, commanded, changed, and how long it took."""

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from benchmark.control.controller import Command, Controller
from benchmark.control.guard import FAULTS, Guard, raised
from benchmark.control.intersection import Intersection
from benchmark.control.plugins import Plugin
from benchmark.control.state import TrafficState
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal
from benchmark.study.episode import Episode, world_of

Commands = Mapping[str, Command]


@dataclass
class Track:
    """What one controller object met in one episode."""

    intersection: Intersection
    seed: int
    states: list[TrafficState] = field(default_factory=list)
    commands: list[Commands] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)  # that act took
    changed: str | None = None  # what it changed first of all that it was given, and when

    def cut(self, steps: int) -> "Track":
        """Its first steps."""
        return replace(self, states=self.states[:steps], commands=self.commands[:steps])


class Watcher(Controller):
    """Stands before a controller and keeps its track.

    Args:
        inner: the controller.
    """

    def __init__(self, inner: Controller) -> None:
        self._inner = inner
        self.weights_hash = inner.weights_hash
        self.track: Track | None = None

    def supports(self, scenario: Scenario) -> str | None:
        """As the controller says."""
        return self._inner.supports(scenario)

    def signal(self, scenario: Scenario, junction: str) -> Signal | None:
        """As the controller says."""
        return self._inner.signal(scenario, junction)

    def reset(self, intersection: Intersection, seed: int) -> None:
        """Begin a track."""
        self.track = Track(intersection, seed)
        self._facts = repr(intersection)
        self._inner.reset(intersection, seed)

    def act(self, state: TrafficState) -> Commands:
        """Ask the controller, with a look at the clock and at what it did to the state."""
        track, untouched = self.track, replace(state)
        assert track is not None
        began = clock.perf_counter()
        commands = self._inner.act(state)
        track.seconds.append(clock.perf_counter() - began)
        track.states.append(untouched)
        if isinstance(commands, Mapping):
            track.commands.append(dict(commands))
        if track.changed is None and (name := _difference(state, untouched)):
            track.changed = f"{name} of the state at {state.time:g} s"
        return commands

    def finish(self) -> Track | None:
        """The track of an episode that is over."""
        if self.track and self.track.changed is None:
            where = self.track.intersection
            if repr(where) != self._facts:
                self.track.changed = "a fact of the intersection"
            elif name := _difference(where, replace(where)):
                self.track.changed = f"{name} of the intersection"
        return self.track


def _difference(given: Any, untouched: Any) -> str | None:
    """An attribute, derived ones included, that is not what it was."""
    return next(
        (
            name
            for name, value in vars(given).items()
            if not hasattr(untouched, name) or getattr(untouched, name) != value
        ),
        None,
    )


@dataclass(frozen=True)
class _Watching(Plugin):
    """A plugin whose controllers are recorded."""

    recorders: list[Watcher] = field(default_factory=list)

    def new(self) -> Watcher:
        self.recorders.append(Watcher(super().new()))
        return self.recorders[-1]


@dataclass(frozen=True)
class Watched:
    """An episode that was watched."""

    skipped: str | None  # why the controller does not support the scenario
    tracks: Sequence[Track] = ()  # one per junction
    refusals: Sequence[str] = ()  # reasons, with how often and when first


def watch_episode(plugin: Plugin, scenario: Scenario, rate: float | None, seed: int) -> Watched:
    """Run an episode.

    Raises:
        ControllerFailedError: the controller raised.
        RightOfWayError: the scenario cannot be run.
    """
    watching = _Watching(plugin.reference, plugin.kind, plugin.options)
    controllers = Guard(watching, scenario)
    if controllers.unsupported is not None:
        return Watched(controllers.unsupported)
    world = world_of(Episode(scenario, plugin.reference, rate, seed), controllers)
    first: dict[str, float] = {}  # reason of a refusal -> when
    with world:
        while not world.over:
            for name, state in world.step().items():
                rules = world.sites[name].rules
                world.carry_out(name, controllers.act(name, state, rules), state.time)
                for reason in rules.refusals.keys() - first.keys():
                    first[reason] = state.time
    counts = {r: n for site in world.sites.values() for r, n in site.rules.refusals.items()}
    return Watched(
        None,
        [track for one in watching.recorders if (track := one.finish())],
        [f"{reason} ({counts[reason]} times, first at {at:g} s)" for reason, at in first.items()],
    )


def answers(controller: Controller, track: Track) -> list[Commands]:
    """What a controller commands when it meets the traffic of a track."""
    with blaming("it"):
        controller.reset(track.intersection, track.seed)
        return [dict(controller.act(replace(state))) for state in track.states]


@contextmanager
def blaming(who: str) -> Iterator[None]:
    """Whatever is raised here is the controller's.

    Raises:
        ControllerFailedError: something was.
    """
    try:
        yield
    except FAULTS as error:
        raise raised(who, error) from error

"""One run: one scenario, controller, penetration rate and seed -> one Record."""

import platform
import time as clock
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass
from functools import partial
from typing import Literal

from benchmark import __version__
from benchmark.control import declarations, plugins, reference
from benchmark.control.guard import ControllerFailedError, Guard
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import Remote, RemoteGuard, isolated
from benchmark.control.plugins import Plugin
from benchmark.pictures.replay.recorder import Recorder
from benchmark.records.record import Record, Versions
from benchmark.scenario.scenario import Scenario
from benchmark.study import identity
from benchmark.study.actions import Recording
from benchmark.sumo import tools
from benchmark.world.world import MeddlingError, World


@dataclass(frozen=True)
class Episode:
    """What is to be run."""

    scenario: Scenario
    controller: str  # its reference, as ``benchmark.control.plugins.find`` reads it in any process
    rate: float | None  # None where the controller commands no vehicle
    seed: int
    isolate: bool | None = None  # None: what is not installed runs in a process of its own
    limits: Limits = DEFAULT  # of an isolated controller

    @property
    def label(self) -> str:
        """The controller as records and messages name it: a file without its folder."""
        return reference.label(self.controller)

    @property
    def key(self) -> tuple[str, str, str, float | None, int]:
        """What tells episodes apart in a leaderboard, as ``Record.episode``."""
        return self.scenario.name, self.scenario.hash, self.label, self.rate, self.seed

    @property
    def controller_from(self) -> str:
        """Where the controller comes from, and a SHA-256 of its code."""
        return identity.origin(self.controller)

    @property
    def identity(self) -> str:
        """SHA-256 of all that determines the record but its wall time."""
        return identity.of(
            scenario_hash=self.scenario.hash,
            controller=self.controller,
            controller_from=self.controller_from,
            rate=self.rate,
            seed=self.seed,
            limits=asdict(self.limits) if isolated(self.controller, self.isolate) else None,
        )

    def record(
        self,
        status: Literal["ok", "failed", "crashed", "timed out", "skipped"],
        **fields: object,
    ) -> Record:
        """A record of this episode."""
        return Record.model_validate(
            {
                "scenario": self.scenario.name,
                "controller": self.label,
                "rate": self.rate,
                "seed": self.seed,
                "status": status,
                "scenario_hash": self.scenario.hash,
                "controller_from": self.controller_from,
                "identity": self.identity,
                "versions": Versions(
                    rightofway=__version__,
                    sumo=tools.sumo_version(),
                    python=platform.python_version(),
                ),
                **fields,
            }
        )


def run(
    episode: Episode,
    *,
    window: bool = False,
    recording: Recording | None = None,
    recorder: Recorder | None = None,
) -> Record:
    """Run an episode to its end.

    A controller that raises or breaks the contract fails its episode: the record says so.

    Args:
        episode: what to run.
        window: show it in sumo-gui.
        recording: is told what the controller commands.
        recorder: keeps where everybody was; empty where the episode does not end well.

    Raises:
        RightOfWayError: the scenario itself cannot be run.
    """
    return run_with(
        partial(opened, episode), episode, window=window, recording=recording, recorder=recorder
    )


Opening = Callable[[], AbstractContextManager[Plugin | Remote]]
"""Opens a controller, here or elsewhere."""


def run_with(
    opening: Opening,
    episode: Episode,
    *,
    source: str | None = None,
    window: bool = False,
    recording: Recording | None = None,
    recorder: Recorder | None = None,
) -> Record:
    """Run an episode under a controller that is not found by its name; otherwise as ``run``.

    Args:
        opening: opens the controller.
        episode: what to run.
        source: where the controller comes from, for the record; None looks its name up.
        window: show it in sumo-gui.
        recording: is told what the controller commands.
        recorder: keeps where everybody was.
    """
    began = clock.perf_counter()
    facts: dict[str, object] = {"controller_from": source} if source else {}
    try:
        with opening() as plugin:
            kind = plugin.kind
            arbitration = kind.arbitration if kind.rules == "robot vehicles" else None
            facts |= {"rules": kind.rules, "arbitration": arbitration}
            if reason := declarations.unmet(kind, episode.scenario, episode.rate):
                return episode.record("skipped", reason=reason, **facts)
            controllers = guard(plugin, episode.scenario)
            if reason := controllers.unsupported:
                return episode.record("skipped", reason=reason, **facts)
            found = _record(
                episode, controllers, facts, window=window, recording=recording, recorder=recorder
            )
    except ControllerFailedError as fault:
        found = episode.record(fault.status, reason=str(fault), **facts)
    except MeddlingError as fault:
        found = episode.record("failed", reason=str(fault), **facts)
    return found.model_copy(update={"wall_time": round(clock.perf_counter() - began, 3)})


def opened(episode: Episode) -> AbstractContextManager[Plugin | Remote]:
    """An episode's controller, here or in a process of its own that ends with the context.

    Raises:
        ControllerError: there is no such controller.
        ControllerFailedError: it fails in its own process.
    """
    if isolated(episode.controller, episode.isolate):
        return Remote(episode.controller, episode.limits)
    return nullcontext(plugins.find(episode.controller))


def guard(plugin: Plugin | Remote, scenario: Scenario) -> Guard | RemoteGuard:
    """What asks a controller on a scenario, wherever it runs."""
    return plugin.guard(scenario) if isinstance(plugin, Remote) else Guard(plugin, scenario)


def world_of(episode: Episode, controllers: Guard | RemoteGuard, *, window: bool = False) -> World:
    """The world of an episode, built, and its controllers told where they are.

    Args:
        episode: what is to be run.
        controllers: who decides; they support the scenario.
        window: show it in sumo-gui.
    """
    kind = controllers.kind
    world = World(
        episode.scenario,
        episode.rate or 0.0,
        episode.seed,
        controller=episode.label,
        signal=controllers.signal,
        arbitration=kind.arbitration if kind.rules == "robot vehicles" else "own",
        window=window,
    )
    intersections = {name: site.junction.intersection for name, site in world.sites.items()}
    controllers.reset(intersections, episode.seed)
    return world


def _record(
    episode: Episode,
    controllers: Guard | RemoteGuard,
    facts: Mapping[str, object],
    *,
    window: bool,
    recording: Recording | None,
    recorder: Recorder | None,
) -> Record:
    world = world_of(episode, controllers, window=window)
    if recording is not None:
        recording.signal = controllers.signal
        for name, site in world.sites.items():
            site.rules.listener = recording.listener(name)
    if recorder is not None:
        world.watch(recorder)
    with world:
        while not world.over:
            for name, state in world.step().items():
                orders = controllers.act(name, state, world.sites[name].rules)
                world.carry_out(name, orders, state.time)
        trips = world.finish()
    return episode.record(
        "ok",
        network_hash=world.network.hash,
        routes_hash=world.routes.hash,
        weights_hash=controllers.weights_hash,
        trained_on=controllers.trained_on,
        junctions=world.junction_metrics(),
        trips=trips,
        **facts,
    )

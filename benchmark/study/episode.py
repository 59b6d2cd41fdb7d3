"""One run: one scenario, controller, penetration rate and seed -> one Record."""

import platform
import time as clock
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass
from functools import partial
from typing import Literal

from benchmark import __version__
from benchmark.control import plugins, reference
from benchmark.control.guard import ControllerFailedError, Decider, Local, Opened
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import Remote, isolated
from benchmark.records.record import Record, Versions
from benchmark.scenario.scenario import Scenario
from benchmark.study import identity
from benchmark.study.actions import Recording
from benchmark.sumo import network, tools
from benchmark.world.onlooker import Onlooker
from benchmark.world.world import MeddlingError, World


@dataclass(frozen=True)
class Episode:
    """What is to be run."""

    scenario: Scenario
    controller: str  # its reference, as ``find_controller`` reads it in any process
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
        return identity.origin_of(self.controller)

    @property
    def identity(self) -> str:
        """SHA-256 of all that determines the record but its wall time."""
        return identity.identity_of(
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


@dataclass(frozen=True)
class Audience:
    """Who looks on at an episode; nothing changes by it."""

    window: bool = False  # people, in sumo-gui
    recording: Recording | None = None  # is told what the controller commands
    onlooker: Onlooker | None = None  # is told what happens


NOBODY = Audience()


def run_episode(episode: Episode, audience: Audience = NOBODY) -> Record:
    """Run an episode to its end.

    A controller that raises or breaks the contract fails its episode: the record says so.

    Args:
        episode: what to run.
        audience: who looks on; of an episode that does not end well it has seen a part.

    Raises:
        RightOfWayError: the scenario itself cannot be run.
    """
    return run_opened(partial(opened, episode), episode, audience)


Opening = Callable[[], AbstractContextManager[Opened]]
"""Opens a controller, here or elsewhere."""


def run_opened(
    opening: Opening, episode: Episode, audience: Audience = NOBODY, *, source: str | None = None
) -> Record:
    """Run an episode under a controller that is not found by its name; otherwise as ``run``.

    Args:
        opening: opens the controller.
        episode: what to run.
        audience: who looks on.
        source: where the controller comes from, for the record; None looks its name up.
    """
    began = clock.perf_counter()
    facts: dict[str, object] = {"controller_from": source} if source else {}
    try:
        with opening() as controller:
            declaration = controller.declaration
            facts |= {"rules": declaration.rules, "arbitration": declaration.arbitrated}
            record = _run(controller, episode, audience, facts)
    except ControllerFailedError as fault:
        record = episode.record(fault.status, reason=str(fault), **facts)
    except MeddlingError as fault:
        record = episode.record("failed", reason=str(fault), **facts)
    return record.model_copy(update={"wall_time": round(clock.perf_counter() - began, 3)})


def opened(episode: Episode) -> AbstractContextManager[Opened]:
    """An episode's controller, here or in a process of its own that ends with the context.

    Raises:
        ControllerError: there is no such controller.
        ControllerFailedError: it fails in its own process.
    """
    if isolated(episode.controller, episode.isolate):
        return Remote(episode.controller, episode.limits)
    return nullcontext(Local(plugins.find_controller(episode.controller)))


def world_of(episode: Episode, decider: Decider, *, window: bool = False) -> World:
    """The world of an episode, built, and its controllers told where they are.

    Args:
        episode: what is to be run.
        decider: who decides; it supports the scenario.
        window: show it in sumo-gui.
    """
    world = World(
        episode.scenario,
        episode.rate or 0.0,
        episode.seed,
        controller=episode.label,
        programs=decider.programs,
        stop_signs=decider.declaration.rules == "stop signs",
        arbitration=decider.declaration.arbitrated or "own",
        window=window,
    )
    intersections = {name: site.junction.intersection for name, site in world.sites.items()}
    decider.reset(intersections, episode.seed)
    return world


def _run(
    controller: Opened, episode: Episode, audience: Audience, facts: Mapping[str, object]
) -> Record:
    """The record of an episode that ends well, or is skipped."""
    intersections = network.build_network(episode.scenario).intersections
    if reason := controller.declaration.unmet(intersections, episode.rate):
        return episode.record("skipped", reason=reason, **facts)
    decider = controller.decider(episode.scenario)
    if reason := decider.unsupported:
        return episode.record("skipped", reason=reason, **facts)
    world = world_of(episode, decider, window=audience.window)
    _seat(audience, world, decider)
    with world:
        while not world.over:
            for name, state in world.step().items():
                orders = decider.act(name, state, world.sites[name].rules)
                world.carry_out(name, orders, state.time)
        trips = world.finish()
    return episode.record(
        "ok",
        network_hash=world.network.hash,
        routes_hash=world.routes.hash,
        weights_hash=decider.weights_hash,
        trained_on=decider.trained_on,
        programs={name: signal.words for name, signal in decider.programs.items()} or None,
        junctions=world.junction_metrics(),
        trips=trips,
        **facts,
    )


def _seat(audience: Audience, world: World, decider: Decider) -> None:
    """Let the audience hear and see what happens in a world."""
    if audience.recording is not None:
        audience.recording.programs = decider.programs
        for name, site in world.sites.items():
            site.rules.listener = audience.recording.listener(name)
    if audience.onlooker is not None:
        world.watch(audience.onlooker)

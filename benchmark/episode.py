"""One run: one scenario, controller, penetration rate and seed -> one Record."""

import platform
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from benchmark import __version__, plugins, sumo_tools
from benchmark.actions import Recording
from benchmark.guard import ControllerFailedError, Guard
from benchmark.plugins import Plugin
from benchmark.record import Record, Versions
from benchmark.scenario import Scenario
from benchmark.world import MeddlingError, World


@dataclass(frozen=True)
class Episode:
    """What is to be run."""

    scenario: Scenario
    controller: str  # its name, with options as ``benchmark.plugins.find`` reads them
    rate: float | None  # None where the controller commands no vehicle
    seed: int

    def record(
        self,
        status: Literal["ok", "failed", "crashed", "timed out", "skipped"],
        **fields: object,
    ) -> Record:
        """A record of this episode."""
        return Record.model_validate(
            {
                "scenario": self.scenario.name,
                "controller": self.controller,
                "rate": self.rate,
                "seed": self.seed,
                "status": status,
                "scenario_hash": self.scenario.hash,
                "versions": Versions(
                    rightofway=__version__,
                    sumo=sumo_tools.sumo_version(),
                    python=platform.python_version(),
                ),
                **fields,
            }
        )


def run(episode: Episode, *, window: bool = False, recording: Recording | None = None) -> Record:
    """Run an episode to its end.

    A controller that raises or breaks the contract fails its episode: the record says so.

    Args:
        episode: what to run.
        window: show it in sumo-gui.
        recording: is told what the controller commands.

    Raises:
        RightOfWayError: the scenario itself cannot be run.
    """
    plugin, source = plugins.find(episode.controller), plugins.provenance(episode.controller)
    return run_plugin(episode, plugin, source, window=window, recording=recording)


def run_plugin(
    episode: Episode,
    plugin: Plugin,
    source: str | None,
    *,
    window: bool = False,
    recording: Recording | None = None,
) -> Record:
    """Run an episode under a controller that was found before; otherwise as ``run``.

    Args:
        episode: what to run.
        plugin: the controller.
        source: the distribution it comes from, for the record.
        window: show it in sumo-gui.
        recording: is told what the controller commands.
    """
    began = clock.perf_counter()
    kind = plugin.kind
    facts = {
        "rules": kind.rules,
        "arbitration": kind.arbitration if kind.rules == "robot vehicles" else None,
        "controller_from": source,
    }
    try:
        controllers = Guard(plugin, episode.scenario)
        if reason := controllers.unsupported:
            return episode.record("skipped", reason=reason, **facts)
        found = _record(episode, controllers, facts, window=window, recording=recording)
    except (ControllerFailedError, MeddlingError) as fault:
        found = episode.record("failed", reason=str(fault), **facts)
    return found.model_copy(update={"wall_time": round(clock.perf_counter() - began, 3)})


def world_of(episode: Episode, controllers: Guard, *, window: bool = False) -> World:
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
        controller=episode.controller,
        signal=controllers.signal,
        arbitration=kind.arbitration if kind.rules == "robot vehicles" else "own",
        window=window,
    )
    controllers.reset({name: site.junction for name, site in world.sites.items()}, episode.seed)
    return world


def _record(
    episode: Episode,
    controllers: Guard,
    facts: Mapping[str, object],
    *,
    window: bool,
    recording: Recording | None,
) -> Record:
    world = world_of(episode, controllers, window=window)
    if recording is not None:
        recording.signal = controllers.signal
        for name, site in world.sites.items():
            site.rules.listener = recording.listener(name)
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

"""One run: one scenario, controller, penetration rate and seed -> one Record."""

import platform
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

from benchmark import __version__, demand, metrics, network, plugins, signals, sumo_tools
from benchmark.demand import Routes
from benchmark.evaluation import junction_metrics
from benchmark.guard import ControllerFailedError, Guard
from benchmark.network import Junction, Network, movement_of
from benchmark.record import Record, Versions
from benchmark.rules import Rules
from benchmark.scenario import Scenario
from benchmark.scenario_tables import Signal
from benchmark.signals import PhaseSwitch
from benchmark.simulation import Simulation
from benchmark.state import TrafficState
from benchmark.tracking import Identity, Tracker


@dataclass(frozen=True)
class Episode:
    """What is to be run."""

    scenario: Scenario
    controller: str
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


def run(episode: Episode, *, window: bool = False) -> Record:
    """Run an episode to its end.

    A controller that raises or breaks the contract fails its episode: the record says so.

    Args:
        episode: what to run.
        window: show it in sumo-gui.

    Raises:
        RightOfWayError: the scenario itself cannot be run.
    """
    began = clock.perf_counter()
    kind = plugins.load(episode.controller)
    facts = {
        "rules": kind.rules,
        "arbitration": kind.arbitration if kind.rules == "robot vehicles" else None,
        "controller_from": plugins.provenance(episode.controller),
    }
    try:
        controllers = Guard(kind, episode.scenario)
        if reason := controllers.unsupported:
            return episode.record("skipped", reason=reason, **facts)
        found = _Run(episode, controllers, window=window).record(facts)
    except ControllerFailedError as fault:
        found = episode.record("failed", reason=str(fault), **facts)
    return found.model_copy(update={"wall_time": round(clock.perf_counter() - began, 3)})


@dataclass
class _Site:
    """One junction while an episode runs."""

    junction: Junction
    tracker: Tracker
    rules: Rules
    switch: PhaseSwitch | None
    held_back: frozenset[str] = frozenset()


@dataclass
class _Run:
    """One episode under way."""

    episode: Episode
    controllers: Guard
    window: bool = False
    robots: set[str] = field(default_factory=set)
    pairs: set[tuple[str, str]] = field(default_factory=set)

    def record(self, facts: Mapping[str, object]) -> Record:
        scenario, seed = self.episode.scenario, self.episode.seed
        self.network: Network = network.build(scenario)
        self.routes: Routes = demand.build(scenario, self.network, seed)
        signal = self.controllers.signal
        if signal is not None:
            signals.check(scenario, signal, self.network)
        program = signals.program_file(scenario, signal, self.network)
        self.junctions = {
            name: _with_phases(junction, signal)
            for name, junction in self.network.junctions.items()
        }
        self.sites = {name: self._site(name) for name in self.junctions}
        self.controllers.reset(self.junctions, seed)
        with Simulation(
            self.network.path,
            self.routes.path,
            program,
            step=scenario.evaluation.step,
            seed=seed,
            window=self.window,
        ) as simulation:
            self.simulation = simulation
            brakings = self._loop()
            trips = simulation.finish()
        return self.episode.record(
            "ok",
            network_hash=self.network.hash,
            routes_hash=self.routes.hash,
            weights_hash=self.controllers.weights_hash,
            junctions={
                name: junction_metrics(
                    scenario.evaluation, site.junction, site.tracker.log, site.rules
                )
                for name, site in self.sites.items()
            },
            trips=metrics.trip_metrics(
                trips, scenario.evaluation.warm_up, self.pairs, self.robots, brakings
            ),
            **facts,
        )

    def _site(self, name: str) -> _Site:
        scenario, junction = self.episode.scenario, self.junctions[name]
        kind, signal = self.controllers.kind, self.controllers.signal
        return _Site(
            junction=junction,
            tracker=Tracker(junction, lambda vehicle: self._identify(name, vehicle)),
            rules=Rules(
                junction.intersection,
                self.episode.controller,
                kind.arbitration if kind.rules == "robot vehicles" else "own",
                lights_on=signal is not None,
            ),
            switch=PhaseSwitch(scenario, signal, junction) if signal else None,
        )

    def _identify(self, junction: str, vehicle: str) -> Identity:
        is_robot = demand.is_robot(self.episode.seed, vehicle, self.episode.rate or 0.0)
        if is_robot:
            self.robots.add(vehicle)
        self.simulation.paint(vehicle, is_robot)
        movement = movement_of(
            self.network.junctions[junction], self.routes.travellers[vehicle].route
        )
        assert movement is not None
        return Identity(vehicle, is_robot, movement, self.simulation.body(vehicle))

    def _loop(self) -> int:
        """Run all steps; return the emergency brakings in the window."""
        evaluation = self.episode.scenario.evaluation
        before_window = 0
        for _ in range(round(evaluation.duration / evaluation.step)):
            time = self.simulation.step()
            for name, site in self.sites.items():
                self._steer(name, site, time)
            if time > evaluation.warm_up:
                self.pairs.update(self.simulation.colliding())
            elif time + evaluation.step > evaluation.warm_up:
                before_window = self.simulation.emergency_brakings()
        return self.simulation.emergency_brakings() - before_window

    def _steer(self, name: str, site: _Site, time: float) -> None:
        simulation = self.simulation
        vehicles, inside = site.tracker.update(
            time,
            simulation.in_zone(site.junction),
            simulation.inside(site.junction),
            site.held_back,
        )
        phase = site.switch.phase if site.switch else None
        state = TrafficState(site.junction.intersection, time, vehicles, inside, phase)
        orders = self.controllers.act(name, state, site.rules)
        site.held_back = orders.held_back
        for vehicle in sorted(orders.released):
            simulation.release(vehicle)
        for vehicle, speed in orders.speeds.items():
            simulation.set_speed(vehicle, speed)
        for vehicle, lane in orders.lanes.items():
            simulation.change_lane(vehicle, lane)
        if site.switch and (lights := site.switch.request(orders.phase, time)):
            simulation.set_lights(name, lights)


def _with_phases(junction: Junction, signal: Signal | None) -> Junction:
    """A junction whose phases are those of the program that runs, if any does."""
    phases = {phase.name: frozenset(phase.movements) for phase in signal.phases} if signal else {}
    intersection = replace(junction.intersection, phases=MappingProxyType(phases))
    return replace(junction, intersection=intersection)

"""One run: one scenario, controller, penetration rate and seed -> one Record."""

import platform
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from benchmark import __version__, demand, metrics, network, plugins, signals, sumo_tools
from benchmark.controller import Controller
from benchmark.demand import Routes
from benchmark.errors import ControllerError, RightOfWayError
from benchmark.network import Junction, Network, movement_of
from benchmark.record import JunctionMetrics, Record, Versions
from benchmark.rules import Orders, Rules
from benchmark.scenario import Scenario
from benchmark.signals import PhaseSwitch
from benchmark.simulation import Simulation
from benchmark.state import TrafficState
from benchmark.tracking import Identity, Tracker

REASONS_KEPT = 5  # kinds of refused commands named in a record


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
        controllers = _Controllers(episode, kind)
        if reason := controllers.unsupported:
            return episode.record("skipped", reason=reason, **facts)
        found = _Run(episode, controllers, window=window).record(facts)
    except _ControllerFailedError as fault:
        found = episode.record("failed", reason=str(fault), **facts)
    return found.model_copy(update={"wall_time": round(clock.perf_counter() - began, 3)})


class _ControllerFailedError(Exception):
    """A controller raised; carries one line for the record."""

    def __init__(self, call: str, error: Exception) -> None:
        place = ""
        trace = error.__traceback__
        while trace is not None:
            place = f" ({Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno})"
            trace = trace.tb_next
        super().__init__(f"{call} raised {type(error).__name__}: {error}{place}")


class _Controllers:
    """An episode's controller: one object per junction, every call guarded."""

    def __init__(self, episode: Episode, kind: type[Controller]) -> None:
        self._episode, self.kind = episode, kind
        scenario = episode.scenario.model_copy(deep=True)  # not ours to lose
        self._first = self._new()
        self._by_junction: dict[str, Controller] = {}
        try:
            self.unsupported = self._first.supports(scenario)
            self.signal = None
            if kind.rules == "signals" and self.unsupported is None:
                self.signal = self._first.signal(scenario)
        except RightOfWayError:
            raise
        except Exception as error:
            raise _ControllerFailedError("supports or signal", error) from error
        self.weights_hash = self._first.weights_hash

    def _new(self) -> Controller:
        try:
            return self.kind()
        except Exception as error:
            raise _ControllerFailedError("construction", error) from error

    def reset(self, junctions: dict[str, Junction]) -> None:
        for name, junction in junctions.items():
            controller = self._by_junction[name] = self._new()
            try:
                controller.reset(junction.intersection, self._episode.seed)
            except Exception as error:
                raise _ControllerFailedError("reset", error) from error

    def act(self, junction: str, state: TrafficState, rules: Rules) -> Orders:
        try:
            return rules.decide(state, self._by_junction[junction].act(state))
        except ControllerError as error:
            raise _ControllerFailedError("act", error) from error
        except Exception as error:
            raise _ControllerFailedError(f"act at {state.time:g} s", error) from error


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
    controllers: _Controllers
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
        self.sites = {name: self._site(name) for name in self.network.junctions}
        self.controllers.reset(dict(self.network.junctions))
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
            junctions={name: self._figures(site) for name, site in self.sites.items()},
            trips=metrics.trip_metrics(
                trips, scenario.evaluation.warm_up, self.pairs, self.robots, brakings
            ),
            **facts,
        )

    def _site(self, name: str) -> _Site:
        scenario, junction = self.episode.scenario, self.network.junctions[name]
        kind, signal = self.controllers.kind, self.controllers.signal
        return _Site(
            junction=junction,
            tracker=Tracker(junction, lambda vehicle: self._identify(name, vehicle)),
            rules=Rules(
                junction.intersection,
                self.episode.controller,
                kind.arbitration,
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
        for vehicle in orders.released:
            simulation.release(vehicle)
        for vehicle, speed in orders.speeds.items():
            simulation.set_speed(vehicle, speed)
        for vehicle, lane in orders.lanes.items():
            simulation.change_lane(vehicle, lane)
        if site.switch and (lights := site.switch.request(orders.phase, time)):
            simulation.set_lights(name, lights)

    def _figures(self, site: _Site) -> JunctionMetrics:
        evaluation, seen = self.episode.scenario.evaluation, _Sights.of(site)
        steps, start = seen.steps, metrics.window_start(site.tracker.log.times, evaluation.warm_up)
        window = seen.step >= start
        counted = window & (seen.movement >= 0)
        last = metrics.last_sights(seen.step, seen.vehicle, start)
        finals = seen.waiting[last]
        who = [site.tracker.log.vehicles[index] for index in seen.vehicle[last]]
        unregulated = metrics.unregulated_ratios(
            seen.step, seen.lane, seen.is_robot, seen.regulated_lanes, steps
        )
        reasons = site.rules.refusals.most_common(REASONS_KEPT)
        return JunctionMetrics(
            average_waiting_time=metrics.average_waiting_time(
                seen.step[window], seen.waiting[window]
            ),
            wang_waiting_time=metrics.wang_waiting_time(
                *(seen.step[counted] - start, seen.movement[counted], seen.waiting[counted]),
                *(len(site.junction.intersection.regulated_movements), steps - start),
            ),
            waiting_time_per_vehicle=metrics.waiting_of(finals),
            waiting_by_kind=metrics.waiting_by(finals, ["RV" if v.is_robot else "HV" for v in who]),
            waiting_by_class=metrics.waiting_by(finals, [v.body.vehicle_class for v in who]),
            waiting_by_movement=metrics.waiting_by(finals, [v.movement for v in who]),
            throughput=metrics.throughput(seen.step[last], start, steps, evaluation.step),
            unregulated_lane_ratio=float(np.mean(unregulated[start:])),
            unregulated_lane_curve=metrics.curve(unregulated, evaluation.step),
            lane_changes=metrics.lane_changes(
                seen.step, seen.vehicle, seen.lane, seen.lane_row, start
            ),
            go_held_back=site.rules.held_back,
            refused_commands=site.rules.refusals.total(),
            refusals=tuple(f"{reason} ({count} times)" for reason, count in reasons),
        )


@dataclass(frozen=True)
class _Sights:
    """A site's log as arrays: an entry per vehicle and step, unless said otherwise."""

    steps: int
    step: metrics.Ints
    vehicle: metrics.Ints
    lane: metrics.Ints
    waiting: metrics.Floats
    movement: metrics.Ints  # index among the regulated movements, -1 for the others
    is_robot: metrics.Bools
    regulated_lanes: metrics.Bools  # by lane
    lane_row: metrics.Ints  # by lane; lanes beside each other share a row

    @classmethod
    def of(cls, site: _Site) -> "_Sights":
        log, junction = site.tracker.log, site.junction
        movements = {name: i for i, name in enumerate(junction.intersection.regulated_movements)}
        rows: dict[tuple[str, float], int] = {}
        places = [junction.zone[lane] for lane in log.lanes]
        vehicle = np.asarray(log.vehicle, dtype=np.int64)
        movement = np.asarray([movements.get(v.movement, -1) for v in log.vehicles], dtype=np.int64)
        robots = np.asarray([one.is_robot for one in log.vehicles], dtype=bool)
        regulated = set(junction.intersection.regulated_lanes)
        return cls(
            steps=len(log.times),
            step=np.repeat(np.arange(len(log.times)), np.asarray(log.present, dtype=np.int64)),
            vehicle=vehicle,
            lane=np.asarray(log.lane, dtype=np.int64),
            waiting=np.asarray(log.waiting, dtype=np.float64),
            movement=movement[vehicle],
            is_robot=robots[vehicle],
            regulated_lanes=np.asarray([lane in regulated for lane in log.lanes]),
            lane_row=np.asarray([rows.setdefault((p.approach, p.end), len(rows)) for p in places]),
        )

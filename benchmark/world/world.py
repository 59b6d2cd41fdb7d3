"""One scenario in motion: advance a step, see the traffic, carry out orders, read the figures.

Who decides is no concern of a world: ``benchmark.study.episode`` asks a controller,
``benchmark.learning`` a policy under training.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal, Self

from benchmark.control.state import TrafficState
from benchmark.records.record import JunctionMetrics, TripMetrics
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal
from benchmark.sumo import demand, network, signals
from benchmark.sumo.demand import Routes
from benchmark.sumo.junction import Junction, movement_of
from benchmark.sumo.network import Network
from benchmark.sumo.signals import PhaseSwitch
from benchmark.sumo.simulation import Simulation
from benchmark.world import metrics
from benchmark.world.gridlock import GridlockWatch, gridlock_after
from benchmark.world.onlooker import Newcomer, Onlooker
from benchmark.world.rules import Orders, Rules
from benchmark.world.scoring import junction_metrics
from benchmark.world.tracking import Identity, Tracker


@dataclass
class Site:
    """One junction of a world."""

    junction: Junction
    tracker: Tracker
    rules: Rules
    gridlock: GridlockWatch
    switch: PhaseSwitch | None
    held_back: frozenset[str] = frozenset()


class MeddlingError(Exception):
    """Somebody moved vehicles by other means than commands."""


class World:
    """A scenario with one seed and penetration rate; a context manager around its simulation.

    Everything is built on construction; the simulation runs from ``__enter__`` on.

    Args:
        scenario: what to run.
        rate: the penetration rate.
        seed: of demand, drivers and RVs.
        controller: who decides, for messages.
        programs: of the lights, by junction; elsewhere they are dark.
        stop_signs: whether stop signs stand in the place of lights.
        arbitration: whether Go commands pass the flexible arbitration.
        window: show the run in sumo-gui.

    Raises:
        RightOfWayError: the scenario cannot be run.
    """

    def __init__(
        self,
        scenario: Scenario,
        rate: float,
        seed: int,
        *,
        controller: str,
        programs: Mapping[str, Signal] = MappingProxyType({}),
        stop_signs: bool = False,
        arbitration: Literal["flexible", "own"] = "flexible",
        window: bool = False,
    ) -> None:
        self.scenario, self.rate, self.seed = scenario, rate, seed
        waiting_lefts = frozenset[str]().union(*(each.permitted for each in programs.values()))
        self.network: Network = network.build_network(
            scenario, stop_signs=stop_signs, waiting_lefts=waiting_lefts
        )
        # drawn on one network for all, so that every controller meets the same vehicles
        dark = network.build_network(scenario)
        self.routes: Routes = demand.build_routes(scenario, dark, seed)
        signals.check_programs(scenario, programs, self.network)
        self.sites = {
            name: self._site(junction, programs.get(name), controller, arbitration)
            for name, junction in self.network.junctions.items()
        }
        self._steps_left = round(scenario.evaluation.duration / scenario.evaluation.step)
        self._robots: set[str] = set()
        self._onlooker: Onlooker | None = None  # told what happens, if there is one
        self._collisions: set[tuple[str, str]] = set()
        self._brakings_before_window = 0
        self._simulation = Simulation(
            self.network.path,
            self.routes.path,
            signals.program_file(programs, self.network),
            step=scenario.evaluation.step,
            seed=seed,
            window=window,
            owner=f"{controller} on {scenario.name} at seed {seed}",
        )

    def _site(
        self,
        junction: Junction,
        signal: Signal | None,
        controller: str,
        arbitration: Literal["flexible", "own"],
    ) -> Site:
        junction = _with_phases(junction, signal)
        return Site(
            junction=junction,
            tracker=Tracker(junction, lambda vehicle: self._identify(junction, vehicle)),
            rules=Rules(
                junction.intersection, controller, arbitration, lights_on=signal is not None
            ),
            gridlock=GridlockWatch(junction.intersection, gridlock_after(signal)),
            switch=PhaseSwitch(signal, junction) if signal else None,
        )

    def _identify(self, junction: Junction, vehicle: str) -> Identity:
        is_robot = demand.is_robot(self.seed, vehicle, self.rate)
        if is_robot:
            self._robots.add(vehicle)
        self._simulation.paint(vehicle, is_robot)
        movement = movement_of(junction, self.routes.travellers[vehicle].route)
        assert movement is not None
        return Identity(vehicle, is_robot, movement, self._simulation.body(vehicle))

    def __enter__(self) -> Self:
        self._simulation.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._simulation.__exit__(*error)

    @property
    def over(self) -> bool:
        """Whether the scenario's last step has been made."""
        return self._steps_left <= 0

    def watch(self, onlooker: Onlooker) -> None:
        """Tell an onlooker what happens from now on."""
        self._onlooker = onlooker
        logs = {name: site.tracker.log for name, site in self.sites.items()}
        onlooker.begin(self.scenario, self.network, logs)

    def step(self) -> Mapping[str, TrafficState]:
        """Simulate one step.

        Returns:
            What is to be seen now at each junction.
        """
        simulation, evaluation = self._simulation, self.scenario.evaluation
        time = simulation.step()
        self._steps_left -= 1
        if time > evaluation.warm_up:
            self._collisions.update(simulation.colliding())
        elif time + evaluation.step > evaluation.warm_up:
            self._brakings_before_window = simulation.emergency_brakings()
        if self._onlooker is not None:
            self._show(self._onlooker, time)
        return {name: self._see(site, time) for name, site in self.sites.items()}

    def _show(self, onlooker: Onlooker, time: float) -> None:
        """Show a step to the onlooker."""
        simulation = self._simulation
        poses = simulation.poses()
        for name in onlooker.strangers(poses):
            traveller = self.routes.travellers[name]
            junctions = self.network.junctions.values()
            movements = (movement_of(junction, traveller.route) for junction in junctions)
            movement = next(filter(None, movements), "")
            is_robot = demand.is_robot(self.seed, name, self.rate)
            size = simulation.size(name)
            onlooker.meet(name, Newcomer(is_robot, movement, traveller.vehicle_class, size))
        lights = {name: simulation.lights(name) for name, site in self.sites.items() if site.switch}
        onlooker.see(time, poses, simulation.colliding(), lights)

    def _see(self, site: Site, time: float) -> TrafficState:
        vehicles, inside = site.tracker.update(
            time,
            self._simulation.in_zone(site.junction),
            self._simulation.inside(site.junction),
            site.held_back,
        )
        phase = site.switch.phase if site.switch else None
        state = TrafficState(site.junction.intersection, time, vehicles, inside, phase)
        site.gridlock.see(state)
        return state

    def carry_out(self, name: str, orders: Orders, time: float) -> None:
        """Hand a junction's orders for the next step to the simulation."""
        site, simulation = self.sites[name], self._simulation
        site.held_back = orders.held_back
        if self._onlooker is not None:
            self._onlooker.order(orders)
        for vehicle in sorted(orders.released):
            simulation.release(vehicle)
        for vehicle, speed in orders.speeds.items():
            simulation.set_speed(vehicle, speed)
        for vehicle, lane in orders.lanes.items():
            simulation.change_lane(vehicle, lane)
        if site.switch and (lights := site.switch.request(orders.phase, time)):
            simulation.set_lights(name, lights)

    def junction_metrics(self) -> dict[str, JunctionMetrics]:
        """The figures of each junction so far."""
        evaluation = self.scenario.evaluation
        return {
            name: junction_metrics(
                evaluation, site.junction, site.tracker.log, site.rules, site.gridlock
            )
            for name, site in self.sites.items()
        }

    def finish(self) -> TripMetrics:
        """End the run and read the figures of whole trips.

        Raises:
            MeddlingError: vehicles were removed or made to stop through libsumo, by nobody here.
        """
        brakings = self._simulation.emergency_brakings() - self._brakings_before_window
        trips = self._simulation.finish()
        if meddled := [trip.id for trip in trips if trip.meddled]:
            raise MeddlingError(
                f"{len(meddled)} vehicles were removed or made to stop past the rules, "
                f"such as {meddled[0]}"
            )
        return metrics.trip_metrics(
            trips,
            self.scenario.evaluation.warm_up,
            self._collisions,
            self._robots,
            brakings,
        )


def _with_phases(junction: Junction, signal: Signal | None) -> Junction:
    """A junction whose phases are those of the program that runs, if any does."""
    phases = signal.movements_by_phase() if signal else {}
    intersection = replace(junction.intersection, phases=MappingProxyType(phases))
    return replace(junction, intersection=intersection)

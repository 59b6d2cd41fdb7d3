"""An episode under time windows, with everything that the rule saw and decided."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from baselines.time_windows.controller import Decisions, TimeWindows
from baselines.time_windows.queues import survey
from baselines.time_windows.reservations import Ledger, members
from baselines.time_windows.stretches import Conflicts
from benchmark.control.controller import Command
from benchmark.control.state import STATIONARY, Crossing, TrafficState, Vehicle
from benchmark.plumbing.errors import UsageError
from benchmark.scenario.scenario import Scenario
from benchmark.world.world import World

Span = tuple[float, float]  # from and to

CLOSE = 12.0  # m; a refused RV that is closer to the entrance would enter soon


@dataclass
class Passing:
    """What is known of a vehicle on its way."""

    is_robot: bool
    way: int  # index into Conflicts.ways
    length: float  # m
    track: list[tuple[float, float, float]] = field(default_factory=list)  # s, m, m/s
    windows: dict[int, Span] = field(default_factory=dict)  # s, by way that it meets; held last
    refused: list[float] = field(default_factory=list)  # s
    led: bool = False  # whether it ever was behind an RV that could stop

    @property
    def entered(self) -> bool:
        """Whether it was seen inside."""
        return self.track[-1][1] > 0

    def on(self, stretch: Span) -> Span:
        """When it was on a stretch of its way [s], given in m behind the entrance."""
        end = stretch[1] + self.length
        time, place, speed = np.array(self.track).T
        late = max(0.0, end - place[-1]) / max(speed[-1], 1.0)  # since it was seen last
        time, place = np.append(time, time[-1] + late), np.append(place, max(end, place[-1]))
        enters, leaves = np.interp((stretch[0], end), place, time)
        return float(enters), float(leaves)


class WatchedTimeWindows(TimeWindows):
    """Time windows that note who was where, who held which windows and who was refused why."""

    def __init__(self) -> None:
        super().__init__()
        self.passings: dict[str, Passing] = {}
        self.refusals = 0  # seconds in which a lane's first RV, close by, was refused
        self.in_the_way: Counter[str] = Counter()  # refusals with such a vehicle in the way
        self._predicted: dict[str, dict[int, Span]] = {}
        self._who: list[Vehicle | Crossing] = []  # by index of their passage

    @property
    def junction(self) -> str:
        """The id of the intersection."""
        return self._intersection.id

    @property
    def conflicts(self) -> Conflicts:
        """The conflict stretches."""
        return self._predictor.conflicts

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        """Note all places and predicted windows, then decide."""
        everybody: dict[str, Vehicle | Crossing] = {}
        for vehicle in state.vehicles:
            everybody[vehicle.id] = vehicle
            self._note(vehicle, -vehicle.distance, state.time)
        for crossing in state.inside:
            everybody[crossing.id] = crossing
            self._note(crossing, crossing.position, state.time)
        now = survey(state, self._ways, self._predictor, self._look_ahead)
        if now.passages:
            windows = self._predictor.windows(now.passages)
            edges = zip(now.passages, windows.enter, windows.leave, strict=True)
            self._predicted = {
                passage.id: {
                    int(way): (state.time + enter[way], state.time + leave[way])
                    for way in np.flatnonzero(~np.isnan(enter))
                }
                for passage, enter, leave in edges
            }
            self._who = [everybody[passage.id] for passage in now.passages]
        return super().act(state)

    def _note(self, vehicle: Vehicle | Crossing, place: float, time: float) -> None:
        if (way := self._ways.get((vehicle.movement, vehicle.lane))) is not None:
            known = Passing(vehicle.is_robot, way, vehicle.body.length)
            self.passings.setdefault(vehicle.id, known).track.append((time, place, vehicle.speed))

    def _arbitrate(self, ledger: Ledger, decisions: Decisions, time: float) -> list[Vehicle]:
        heads = super()._arbitrate(ledger, decisions, time)
        for vehicle in decisions.accepted:
            self.passings[vehicle.id].windows = self._predicted[vehicle.id]
        for vehicle in decisions.refused:
            self.passings[vehicle.id].refused.append(time)
        for queue in decisions.queues:
            for platoon in queue.platoons:
                for index in platoon.followers:
                    self.passings[self._who[index].id].led = True
            if queue.platoons and queue.platoons[0].leader in heads:
                first = queue.platoons[0]
                if first.leader.distance <= CLOSE:
                    self._blame(ledger.in_the_way(first.index))
        return heads

    def _blame(self, bits: int) -> None:
        self.refusals += 1
        self.in_the_way.update({self._kind(self._who[index]) for index in members(bits)})

    def _kind(self, vehicle: Vehicle | Crossing) -> str:
        if isinstance(vehicle, Crossing):
            return "stands inside" if vehicle.speed < STATIONARY else "drives inside"
        if vehicle.is_robot:
            return "RV that was accepted or cannot stop"
        return "HV behind an RV" if self.passings[vehicle.id].led else "HV that no RV led"


def watched(scenario: Scenario, rate: float, seed: int) -> WatchedTimeWindows:
    """Run an episode at an intersection under time windows and note what happens.

    Raises:
        UsageError: the scenario has several junctions.
    """
    world = World(scenario, rate, seed, controller="time-windows", arbitration="own")
    if len(world.sites) > 1:
        raise UsageError(f"{scenario.name}: has {len(world.sites)} junctions; give one with one")
    ((name, site),) = world.sites.items()
    controller = WatchedTimeWindows()
    controller.reset(site.junction.intersection, seed)
    with world:
        while not world.over:
            state = world.step()[name]
            world.carry_out(name, site.rules.decide(state, controller.act(state)), state.time)
    return controller

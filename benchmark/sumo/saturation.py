"""Saturation: what lanes discharge, what right turns on red take away, and demand over capacity.

The Highway Capacity Manual's lane groups (HCM 6, chapter 19): drivers choose among the lanes that
serve them so that the busiest lane carries the least.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

from benchmark.control.intersection import Intersection, Movement
from benchmark.scenario.demand import busiest
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal, SignalPhase
from benchmark.scenario.vehicles import Idm, VehicleClass

PERMITTED_LEFT = 4.5, 2.5  # critical gap and follow-up time [s] (HCM 2010, exhibit 31-20 region)
RIGHT_TURN = 6.2, 3.3  # of right turns that filter [s] (HCM 6, chapter 20)
KERB_LENGTHS = {"passenger": 5.0, "truck": 7.1, "bus": 12.0, "motorcycle": 2.2}  # m, SUMO's


def saturation_flow(scenario: Scenario, movement: Movement) -> float:
    """What one lane of a movement discharges while its queue lasts [veh/h].

    The greatest equilibrium flow ``3600 v / (gap(v) + length)`` of the scenario's drivers at the
    speed that their way allows. Queues start from a standstill, so discharge in SUMO differs from
    it with speed, green and driver: docs/methods.md has the measured table (``make saturation``).
    """
    free = min(way.speed_limit for way in movement.ways)
    if scenario.intersection.speed_cap:
        free = min(free, scenario.intersection.speed_cap)
    headway = sum(
        vehicle.share / _greatest_flow(vehicle, free) for vehicle in scenario.vehicles.values()
    )
    return 3600 / headway


def _greatest_flow(vehicle: VehicleClass, free: float) -> float:
    """Greatest equilibrium flow of a class [veh/s]; gaps by the car-following model's equation."""
    driver, length = vehicle.car_following, vehicle.length or KERB_LENGTHS[vehicle.kind]
    speeds = [free * step / 200 for step in range(1, 200)]

    def gap(speed: float) -> float:
        wanted = driver.minimum_gap + driver.headway * speed
        if isinstance(driver, Idm):
            return wanted / math.sqrt(1 - (speed / free) ** 4)
        return wanted

    return max(speed / (gap(speed) + length) for speed in speeds)


def filtering_flow(opposing: float, critical_gap: float, follow_up: float) -> float:
    """What finds gaps in an opposing stream (HCM 2010, chapter 31).

    Args:
        opposing: [veh/h].
        critical_gap: the shortest gap that a driver takes [s].
        follow_up: between two drivers in one gap [s].

    Returns:
        [veh/h].
    """
    if opposing <= 0:
        return 3600 / follow_up
    rate = opposing / 3600
    return opposing * math.exp(-rate * critical_gap) / -math.expm1(-rate * follow_up)


def count(scenario: Scenario, intersection: Intersection, movement: str) -> float:
    """A movement's turning count in the busiest 15 minutes [veh/h]."""
    road = intersection.movements[movement]
    return busiest(scenario.demand).counts(road.approach).of(road.turn)


@dataclass(frozen=True)
class LaneGroup:
    """Movements of one approach that share lanes."""

    movements: tuple[str, ...]
    lanes: tuple[frozenset[str], ...]  # the movements of each lane

    def loads(self, asked: Mapping[str, float]) -> dict[str, float]:
        """The load of the busiest lane that each movement needs.

        Args:
            asked: what each movement asks of a lane of its own, in units of that lane.
        """
        loads: dict[str, float] = {}
        lanes = list(self.lanes)
        left = [name for name in self.movements if name in asked]
        while left:
            load, _, chosen = max(
                (sum(asked[name] for name in names) / max(1, _touched(lanes, names)), size, names)
                for size in range(1, len(left) + 1)
                for names in combinations(left, size)
            )
            loads |= dict.fromkeys(chosen, load)
            lanes = [lane for lane in lanes if not lane & set(chosen)]
            left = [name for name in left if name not in chosen]
        return loads


def _touched(lanes: Iterable[frozenset[str]], names: Iterable[str]) -> int:
    return sum(bool(lane & set(names)) for lane in lanes)


def lane_groups(scenario: Scenario, intersection: Intersection) -> list[LaneGroup]:
    """Movements joined where they share a lane, kerb turns too.

    Kerb turns on a slip lane of their own pass beside the signal and are left out.
    """
    lanes = [
        frozenset(name for name in lane.movements if intersection.movements[name].ways)
        for lane in intersection.lanes.values()
    ]
    groups: list[set[str]] = []
    for lane in filter(None, lanes):
        joined = [group for group in groups if group & lane]
        groups = [group for group in groups if not group & lane]
        groups.append(set(lane).union(*joined))
    return [
        LaneGroup(tuple(sorted(group)), tuple(lane for lane in lanes if lane & group))
        for group in sorted(groups, key=sorted)
        if not _passes_beside(scenario, intersection, group)
    ]


def _passes_beside(scenario: Scenario, intersection: Intersection, group: Iterable[str]) -> bool:
    movements = [intersection.movements[name] for name in group]
    return all(
        movement.keeps_to_kerb and scenario.approaches.of(movement.approach).slip_lane
        for movement in movements
    )


class Loading:
    """How a signal program carries the counts of the peak period."""

    def __init__(self, scenario: Scenario, intersection: Intersection, signal: Signal) -> None:
        self._scenario, self._intersection, self._signal = scenario, intersection, signal
        self._groups = lane_groups(scenario, intersection)
        self._mates = {
            name: frozenset().union(*(lane for lane in group.lanes if name in lane)) - {name}
            for group in self._groups
            for name in group.movements
        }

    def degrees(self) -> dict[str, float]:
        """Demand over capacity of each movement in its lane group; 1 is saturated."""
        degrees: dict[str, float] = {}
        for group in self._groups:
            degrees |= group.loads({name: self._degree(name) for name in group.movements})
        return degrees

    def critical_ratio(self, phase: SignalPhase) -> float:
        """Greatest flow ratio of a lane that a phase must serve, y in Webster's method."""
        ratios = [0.0]
        for group in self._groups:
            asked = {
                name: self._asked(name) / self.saturation(phase, name)
                for name in group.movements
                if phase in self._main_phases(name)
            }
            ratios += group.loads(asked).values()
        return max(ratios)

    def saturation(self, phase: SignalPhase, movement: str) -> float:
        """Saturation flow of one lane in a phase; a permitted movement filters [veh/h]."""
        protected = saturation_flow(self._scenario, self._intersection.movements[movement])
        if movement not in phase.permitted:
            return protected
        conflicts = self._intersection.movements[movement].conflicts & set(phase.movements)
        opposing = sum(self._count(other) for other in sorted(conflicts))
        return min(protected, filtering_flow(opposing, *PERMITTED_LEFT)) if opposing else protected

    def turned_on_red(self, movement: str) -> float:
        """Kerb turns that leave while their light is red [veh/h]."""
        return min(self._count(movement), self._capacity_on_red(movement))

    def _capacity_on_red(self, movement: str) -> float:
        """What kerb turns can do on red: filter into the traffic of their exit [veh/h].

        On a shared lane no more of them leave in a cycle than stand before the first vehicle that
        does not turn.
        """
        road = self._intersection.movements[movement]
        if not road.keeps_to_kerb or not self._scenario.approaches.of(road.approach).right_on_red:
            return 0.0
        green = sum(phase.green for phase in self._phases(movement)) / self._signal.cycle
        filtering = max(0.0, 1 - green) * self._merging(road)
        if others := sum(self._on_a_lane(other) for other in self._mates[movement]):
            in_front = len(road.lanes) * self._on_a_lane(movement) / others
            return min(filtering, in_front * 3600 / self._signal.cycle)
        return filtering

    def _on_a_lane(self, movement: str) -> float:
        return self._count(movement) / len(self._intersection.movements[movement].lanes)

    def _merging(self, road: Movement) -> float:
        stream = sum(
            self._count(other.id)
            for other in self._intersection.movements.values()
            if other.exit == road.exit and other is not road
        )
        return filtering_flow(stream, *RIGHT_TURN)

    def _count(self, movement: str) -> float:
        return count(self._scenario, self._intersection, movement)

    def _asked(self, movement: str) -> float:
        return self._count(movement) - self.turned_on_red(movement)

    def _degree(self, movement: str) -> float:
        """Demand over capacity, had the movement one lane and that to itself."""
        served, counted = self._served(movement), self._count(movement)
        if self._mates[movement] and served:
            return self._asked(movement) / served
        served += self._capacity_on_red(movement)
        return counted / served if served else math.inf if counted else 0.0

    def _served(self, movement: str) -> float:
        """Capacity of one lane over the cycle [veh/h]."""
        return sum(
            self.saturation(phase, movement) * phase.green / self._signal.cycle
            for phase in self._phases(movement)
        )

    def _phases(self, movement: str) -> list[SignalPhase]:
        """The phases in which a movement can discharge."""
        road = self._intersection.movements[movement]
        if not road.keeps_to_kerb:
            return self._green_with({movement})
        if mates := self._mates[movement]:
            return self._green_with(mates | {movement})
        return self._green_with(_of_approach(self._intersection, road.approach))

    def _main_phases(self, movement: str) -> list[SignalPhase]:
        """The phases that must be long enough for a movement.

        A kerb turn that has its lane to itself takes what the through traffic beside it has.
        """
        phases = self._phases(movement)
        road = self._intersection.movements[movement]
        if not road.keeps_to_kerb or self._mates[movement]:
            return phases
        through = [
            name
            for name in _of_approach(self._intersection, road.approach)
            if self._intersection.movements[name].turn == "C" or name == movement
        ]
        return self._green_with(through) or phases

    def _green_with(self, movements: Iterable[str]) -> list[SignalPhase]:
        return [phase for phase in self._signal.phases if set(movements) & set(phase.movements)]


def _of_approach(intersection: Intersection, approach: str) -> list[str]:
    return [name for name, road in intersection.movements.items() if road.approach == approach]


def degrees_of_saturation(
    scenario: Scenario, intersection: Intersection, signal: Signal
) -> dict[str, float]:
    """Demand over capacity of each movement under a program; 1 is saturated."""
    return Loading(scenario, intersection, signal).degrees()

"""Webster's method: saturation flows, degrees of saturation, cycle and splits from counts.

F. V. Webster, Traffic Signal Settings, Road Research Technical Paper 39, 1958. Effective green is
taken as displayed green, so the lost time of a phase is its yellow and all-red.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from benchmark.control.intersection import Intersection, Movement
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal, SignalPhase
from benchmark.scenario.vehicles import Idm, VehicleClass

SHORTEST_CYCLE, LONGEST_CYCLE = 40.0, 180.0  # s
PRACTICAL = 0.95  # sum of critical flow ratios above which the longest cycle is taken
CRITICAL_GAP, FOLLOW_UP = 4.5, 2.5  # s, of permitted lefts (HCM 2010, exhibit 31-20 region)
REACTION, BRAKING = 1.0, 3.05  # s and m/s2 of the yellow's length (ITE)
KERB_LENGTHS = {"passenger": 5.0, "truck": 7.1, "bus": 12.0, "motorcycle": 2.2}  # m, SUMO's


def saturation_flow(scenario: Scenario, movement: Movement) -> float:
    """What one lane of a movement discharges while its queue lasts [veh/h].

    The greatest equilibrium flow ``3600 v / (gap(v) + length)`` of the scenario's drivers at the
    speed that their way allows; measured discharge agrees within 5 % for cross movements.
    """
    free = min(way.speed_limit for way in movement.ways)
    if scenario.intersection.speed_cap:
        free = min(free, scenario.intersection.speed_cap)
    headway = sum(
        vehicle.share / _capacity(vehicle, free) for vehicle in scenario.vehicles.values()
    )
    return 3600 / headway


def _capacity(vehicle: VehicleClass, free: float) -> float:
    """Greatest equilibrium flow of a class [veh/s]; gaps by the car-following model's equation."""
    driver, length = vehicle.car_following, vehicle.length or KERB_LENGTHS[vehicle.kind]
    speeds = [free * step / 200 for step in range(1, 200)]

    def gap(speed: float) -> float:
        wanted = driver.minimum_gap + driver.headway * speed
        if isinstance(driver, Idm):
            return wanted / math.sqrt(1 - (speed / free) ** 4)
        return wanted

    return max(speed / (gap(speed) + length) for speed in speeds)


@dataclass(frozen=True)
class LaneGroup:
    """Movements of one approach that share lanes, and what they ask for."""

    movements: tuple[str, ...]
    lanes: int

    def flow_ratio(
        self, scenario: Scenario, intersection: Intersection, phase: SignalPhase
    ) -> float:
        """Demand over saturation flow while a phase is green, y in Webster's method."""
        return (
            sum(
                count(scenario, intersection, name)
                / _saturation_in(scenario, intersection, phase, name)
                for name in self.movements
            )
            / self.lanes
        )


def lane_groups(intersection: Intersection) -> list[LaneGroup]:
    """Regulated movements joined where they share a lane; right turns filter and are left out."""
    groups: list[set[str]] = []
    for lane in intersection.lanes.values():
        served = {name for name in lane.movements if intersection.movements[name].regulated}
        if not served:
            continue
        joined = [group for group in groups if group & served]
        groups = [group for group in groups if not group & served]
        groups.append(served.union(*joined))
    return [
        LaneGroup(
            tuple(sorted(group)),
            sum(bool(group & set(lane.movements)) for lane in intersection.lanes.values()),
        )
        for group in sorted(groups, key=sorted)
    ]


def count(scenario: Scenario, intersection: Intersection, movement: str) -> float:
    """A movement's turning count in the peak period [veh/h]."""
    road = intersection.movements[movement]
    return scenario.peak.counts(road.approach).of(road.turn)


def _saturation_in(
    scenario: Scenario, intersection: Intersection, phase: SignalPhase, movement: str
) -> float:
    """Saturation flow of one lane in a phase; a permitted movement filters through gaps [veh/h]."""
    protected = saturation_flow(scenario, intersection.movements[movement])
    if movement not in phase.permitted:
        return protected
    opposing = (
        sum(
            count(scenario, intersection, other)
            for other in sorted(intersection.movements[movement].conflicts & set(phase.movements))
        )
        / 3600
    )
    if opposing == 0:
        return protected
    filtered = opposing * math.exp(-opposing * CRITICAL_GAP) / -math.expm1(-opposing * FOLLOW_UP)
    return min(protected, 3600 * filtered)


def degrees_of_saturation(
    scenario: Scenario, intersection: Intersection, signal: Signal
) -> dict[str, float]:
    """Demand over capacity of each regulated movement under a program; 1 is saturated."""
    degrees = {}
    for group in lane_groups(intersection):
        shares = [
            phase.green / signal.cycle / ratio
            for phase in signal.phases
            if set(group.movements) & set(phase.movements)
            and (ratio := group.flow_ratio(scenario, intersection, phase)) > 0
        ]
        degree = 1 / sum(shares) if shares else 0.0
        degrees.update(dict.fromkeys(group.movements, degree))
    return degrees


def retimed(scenario: Scenario, intersection: Intersection, signal: Signal) -> Signal:
    """A program with the phases of another, and cycle and splits by Webster's method."""
    ratios = [_critical(scenario, intersection, phase) for phase in signal.phases]
    greens = _splits(ratios, signal)
    phases = tuple(
        phase.model_copy(update={"green": green, "minimum_green": min(phase.minimum_green, green)})
        for phase, green in zip(signal.phases, greens, strict=True)
    )
    return signal.model_copy(update={"kind": "fixed", "phases": phases})


def _critical(scenario: Scenario, intersection: Intersection, phase: SignalPhase) -> float:
    return max(
        (
            group.flow_ratio(scenario, intersection, phase)
            for group in lane_groups(intersection)
            if set(group.movements) & set(phase.movements)
        ),
        default=0.0,
    )


def _splits(ratios: Sequence[float], signal: Signal) -> list[float]:
    """Greens to whole seconds: ``C = (1.5 L + 5) / (1 - Y)``, ``g_i = (C - L) y_i / Y``."""
    lost = len(ratios) * (signal.yellow + signal.all_red)
    total = sum(ratios)
    wanted = (1.5 * lost + 5) / (1 - total) if total < PRACTICAL else LONGEST_CYCLE
    cycle = min(max(wanted, SHORTEST_CYCLE, lost + 5.0 * len(ratios)), LONGEST_CYCLE)
    return [max(5.0, round((cycle - lost) * ratio / total)) if total else 5.0 for ratio in ratios]


def propose_program(scenario: Scenario, intersection: Intersection) -> Signal:
    """A fixed program from counts alone: phases, yellow, all-red, cycle and splits.

    Of all ways to put the lane groups into phases the one with the least total flow ratio and lost
    time is taken; lefts lead. Groups whose only conflict is a left on a shared lane may go
    together, the left then yields.
    """
    yellow, all_red = _change_times(intersection)
    groups = lane_groups(intersection)

    def order(phase: SignalPhase) -> tuple[int, bool]:
        return _axis(intersection, phase), "C" in _turns(intersection, phase)

    def program(partition: list[list[LaneGroup]]) -> Signal:
        phases = [_phase(intersection, members) for members in partition]
        phases.sort(key=order)
        return Signal(kind="fixed", yellow=yellow, all_red=all_red, phases=tuple(phases))

    def cost(signal: Signal) -> tuple[float, int, str]:
        total = sum(_critical(scenario, intersection, phase) for phase in signal.phases)
        lost = len(signal.phases) * (yellow + all_red)
        cycle = (1.5 * lost + 5) / (1 - total) if total < 1 else 1e6 * total
        mixed = sum(len(_turns(intersection, phase)) > 1 for phase in signal.phases)
        return (round(cycle, 6), mixed, "/".join(phase.name for phase in signal.phases))

    candidates = [
        program(partition) for partition in _partitions(intersection, groups) if len(partition) > 1
    ]
    return retimed(scenario, intersection, min(candidates, key=cost))


def _change_times(intersection: Intersection) -> tuple[float, float]:
    """Yellow and all-red by the fastest approach, to half seconds (ITE)."""
    fastest = max(lane.speed_limit for lane in intersection.lanes.values())
    longest = max(way.length for road in intersection.movements.values() for way in road.ways)
    yellow = min(max(REACTION + fastest / (2 * BRAKING), 3.0), 5.0)
    all_red = min(max((longest + 5.0) / fastest, 1.0), 2.0)
    return round(2 * yellow) / 2, round(2 * all_red) / 2


def _partitions(
    intersection: Intersection, groups: Sequence[LaneGroup]
) -> Iterator[list[list[LaneGroup]]]:
    """All ways to put lane groups into phases in which everybody may go together."""
    if not groups:
        yield []
        return
    first, rest = groups[0], groups[1:]
    for partition in _partitions(intersection, rest):
        yield [[first], *partition]
        for index, members in enumerate(partition):
            if all(_together(intersection, first, member) for member in members):
                yield [*partition[:index], [first, *members], *partition[index + 1 :]]


def _together(intersection: Intersection, first: LaneGroup, second: LaneGroup) -> bool:
    return all(
        _yielder(intersection, first, second, a, b) is not None
        for a in first.movements
        for b in second.movements
        if intersection.conflict(a, b)
    )


def _yielder(
    intersection: Intersection, first: LaneGroup, second: LaneGroup, a: str, b: str
) -> str | None:
    """Which of two conflicting movements yields: a left on a shared lane to a cross movement."""
    for group, movement, against in ((first, a, b), (second, b, a)):
        turns = [intersection.movements[name].turn for name in (movement, against)]
        if len(group.movements) > 1 and turns == ["L", "C"]:
            return movement
    return None


def _phase(intersection: Intersection, members: Sequence[LaneGroup]) -> SignalPhase:
    permitted = {
        yielding
        for first in members
        for second in members
        if first is not second
        for a in first.movements
        for b in second.movements
        if intersection.conflict(a, b) and (yielding := _yielder(intersection, first, second, a, b))
    }
    names = [name for group in members for name in group.movements]
    return SignalPhase(
        movements=tuple(names), permitted=tuple(permitted), green=5.0, minimum_green=5.0
    )


def _axis(intersection: Intersection, phase: SignalPhase) -> int:
    order = list(dict.fromkeys(road.approach for road in intersection.movements.values()))
    return min(order.index(intersection.movements[name].approach) % 2 for name in phase.movements)


def _turns(intersection: Intersection, phase: SignalPhase) -> set[str]:
    return {intersection.movements[name].turn for name in phase.movements}

"""Webster's method: phases, cycle and splits from counts.

F. V. Webster, Traffic Signal Settings, Road Research Technical Paper 39, 1958. Effective green is
taken as displayed green, so the lost time of a phase is its yellow and all-red.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from benchmark.control.intersection import Intersection
from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal, SignalPhase
from benchmark.sumo.saturation import LaneGroup, Loading, lane_groups

SHORTEST_CYCLE, LONGEST_CYCLE = 40.0, 180.0  # s
SHORTEST_GREEN = 5.0  # s
FIRST_GREEN = 25.0  # s, from which splits are sought
PRACTICAL = 0.95  # sum of critical flow ratios above which the longest cycle is taken
REACTION, BRAKING = 1.0, 3.05  # s and m/s2, of the yellow's length
VEHICLE_LENGTH = 5.0  # m, of the all-red's length


def retimed(scenario: Scenario, intersection: Intersection, signal: Signal) -> Signal:
    """A program with the phases of another, and cycle and splits by Webster's method.

    How many turn right on red depends on the splits, so they are computed twice. No green is
    shorter than its phase's minimum.
    """
    for _ in range(2):
        loading = Loading(scenario, intersection, signal)
        greens = _splits([loading.critical_ratio(phase) for phase in signal.phases], signal)
        phases = tuple(
            phase.model_copy(update={"green": green})
            for phase, green in zip(signal.phases, greens, strict=True)
        )
        signal = signal.model_copy(update={"kind": "fixed", "phases": phases})
    return signal


def _splits(ratios: Sequence[float], signal: Signal) -> list[float]:
    """Greens to whole seconds: ``C = (1.5 L + 5) / (1 - Y)``, ``g_i = (C - L) y_i / Y``.

    A phase whose share is below its minimum has the minimum, which the others' share then counts as
    time lost.
    """
    lost = len(ratios) * (signal.yellow + signal.all_red)
    least = [max(SHORTEST_GREEN, phase.minimum_green) for phase in signal.phases]
    held: set[int] = set()
    while True:
        taken = sum(least[index] for index in held)
        total = sum(ratio for index, ratio in enumerate(ratios) if index not in held)
        spare = _cycle(1.5 * lost + 5, total, taken) - lost - taken
        greens = [
            least[index] if index in held or not total else spare * ratio / total
            for index, ratio in enumerate(ratios)
        ]
        short = {index for index, green in enumerate(greens) if green < least[index]} - held
        if not short:
            return [max(float(round(g)), m) for g, m in zip(greens, least, strict=True)]
        held |= short


def _cycle(overhead: float, ratio: float, taken: float) -> float:
    """Webster's cycle, within bounds, where some phases have taken their minimum [s]."""
    wanted = (overhead + taken) / (1 - ratio) if ratio < PRACTICAL else LONGEST_CYCLE
    return max(min(max(wanted, SHORTEST_CYCLE), LONGEST_CYCLE), taken)


def propose_program(scenario: Scenario, intersection: Intersection) -> Signal:
    """A fixed program from counts alone: phases, yellow, all-red, cycle and splits.

    Of all ways to put the lane groups into phases the one with the least total flow ratio and lost
    time is taken; lefts lead. Groups whose only conflict is a left on a shared lane may go
    together, the left then yields.

    Raises:
        ScenarioError: fewer than two groups need a green of their own.
    """
    yellow, all_red = _proposed_times(scenario, intersection)
    groups = list(_groups_to_serve(scenario, intersection))
    if len(groups) < 2:
        raise ScenarioError(
            f"{scenario.name}: nothing for a signal to separate: only "
            f"{' and '.join(groups[0].movements)} would need a green; run it without a signal"
        )

    def order(phase: SignalPhase) -> tuple[int, bool]:
        return _axis(intersection, phase), "C" in _turns(intersection, phase)

    def program(partition: list[list[LaneGroup]]) -> Signal:
        phases = [_phase(intersection, members) for members in partition]
        phases.sort(key=order)
        signal = Signal(kind="fixed", yellow=yellow, all_red=all_red, phases=tuple(phases))
        return retimed(scenario, intersection, signal)

    def cost(signal: Signal) -> tuple[float, int, str]:
        loading = Loading(scenario, intersection, signal)
        total = sum(loading.critical_ratio(phase) for phase in signal.phases)
        lost = len(signal.phases) * (yellow + all_red)
        cycle = (1.5 * lost + 5) / (1 - total) if total < 1 else 1e6 * total
        mixed = sum(len(_turns(intersection, phase)) > 1 for phase in signal.phases)
        return (round(cycle, 6), mixed, "/".join(phase.name for phase in signal.phases))

    candidates = [
        program(partition) for partition in _partitions(intersection, groups) if len(partition) > 1
    ]
    return min(candidates, key=cost)


def _groups_to_serve(scenario: Scenario, intersection: Intersection) -> Iterator[LaneGroup]:
    """Lane groups without their kerb turns, which go with their approach.

    Kerb turns of an approach that has no others and may not turn on red need a green too.
    """
    movements = intersection.movements
    for group in lane_groups(scenario, intersection):
        regulated = {name for name in group.movements if movements[name].regulated}
        approach = movements[group.movements[0]].approach
        alone = not any(m.regulated for m in movements.values() if m.approach == approach)
        if not regulated and alone and not scenario.approaches.of(approach).right_on_red:
            regulated = set(group.movements)
        if regulated:
            lanes = (lane & regulated for lane in group.lanes)
            yield LaneGroup(tuple(sorted(regulated)), tuple(filter(None, lanes)))


class ChangeTimes(NamedTuple):
    """Between two phases [s]."""

    yellow: float
    all_red: float


def change_times(intersection: Intersection) -> ChangeTimes:
    """Yellow and all-red by the fastest approach and the longest way.

    ``y = t + v / (2 a)`` and ``r = (W + L) / v - 1`` (McGee et al., Guidelines for Timing Yellow
    and All-Red Intervals at Signalized Intersections, NCHRP Report 731, 2012), within bounds.
    """
    fastest = max(lane.speed_limit for lane in intersection.lanes.values())
    longest = max(way.length for road in intersection.movements.values() for way in road.ways)
    yellow = min(max(REACTION + fastest / (2 * BRAKING), 3.0), 5.0)
    all_red = min(max((longest + VEHICLE_LENGTH) / fastest - 1, 1.0), 3.0)
    return ChangeTimes(yellow, all_red)


def _proposed_times(scenario: Scenario, intersection: Intersection) -> list[float]:
    """Yellow and all-red to half seconds, never shorter than the scenario's own."""
    deployed = scenario.junctions[intersection.id].signal
    return [
        max(round(2 * time) / 2, getattr(deployed, key, 0.0))
        for key, time in change_times(intersection)._asdict().items()
    ]


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
    """Which of two conflicting movements yields: a crossing turn that shares cross lanes."""
    for group, movement, against in ((first, a, b), (second, b, a)):
        yields, passes = intersection.movements[movement], intersection.movements[against]
        shares = any(intersection.movements[name].turn == "C" for name in group.movements)
        meets = passes.turn == "C" or passes.crosses_oncoming
        if shares and yields.crosses_oncoming and meets:
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
    return SignalPhase(movements=tuple(names), permitted=tuple(permitted), green=FIRST_GREEN)


def _axis(intersection: Intersection, phase: SignalPhase) -> int:
    order = list(dict.fromkeys(road.approach for road in intersection.movements.values()))
    return min(order.index(intersection.movements[name].approach) % 2 for name in phase.movements)


def _turns(intersection: Intersection, phase: SignalPhase) -> set[str]:
    return {intersection.movements[name].turn for name in phase.movements}

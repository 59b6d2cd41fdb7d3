"""What a scenario file may say and hardly means: slips of units, gaps in time, roads too short."""

import math
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

from benchmark.scenario.scenario import Scenario

FASTEST = 27.0  # m/s; hardly an intersection has faster approaches (60 mph)
SLOWEST = 2.0  # m/s; a walk
MPH = 0.44704  # m/s
MOST_LANES = 8  # of an approach
SHORTEST_ROAD = 20.0  # m; two or three vehicles
MOST_RATES = 21  # every five percent


def doubts(scenario: Scenario) -> Iterator[str]:
    """What is probably a slip, in words that name the key."""
    yield from _of_speeds(scenario)
    yield from _of_roads(scenario)
    yield from _of_phases(scenario)
    yield from _of_demand(scenario)
    yield from _of_evaluation(scenario)


def _of_speeds(scenario: Scenario) -> Iterator[str]:
    for name, approach in scenario.approaches.items():
        if (speed := approach.speed_limit) > FASTEST:
            yield (
                f"approaches.{name}.speed_limit: {speed:g} m/s are {3.6 * speed:.0f} km/h; if "
                f"{speed:g} are miles an hour, write {MPH * speed:.4g}"
            )
        elif speed < SLOWEST:
            yield f"approaches.{name}.speed_limit: {speed:g} m/s is slower than a walk"
    cap = scenario.intersection.speed_cap
    if cap is not None and cap < SLOWEST:
        yield f"intersection.speed_cap: {cap:g} m/s is slower than a walk"


def _of_roads(scenario: Scenario) -> Iterator[str]:
    zone = scenario.intersection.control_zone
    for name, approach in scenario.approaches.items():
        if approach.length < SHORTEST_ROAD:
            yield (
                f"approaches.{name}.length: {approach.length:g} m hold no queue; give the road "
                f"from the last intersection, or at least control_zone ({zone:g} m)"
            )
        elif approach.length < zone:
            yield (
                f"approaches.{name}: length ({approach.length:g} m) is shorter than control_zone "
                f"({zone:g} m); queues are cut off"
            )
        if (lanes := len(approach.lane_turns)) > MOST_LANES:
            yield (
                f"approaches.{name}.lanes: {lanes} lanes at the entrance; hardly a road has more "
                f"than {MOST_LANES}"
            )


def _of_phases(scenario: Scenario) -> Iterator[str]:
    for signal in scenario.programs.values():
        for index, phase in enumerate(signal.phases):
            for name in phase.permitted:
                if name.endswith("C"):
                    yield (
                        f"signal.phases[{index}].permitted: {name} goes straight on; drivers who "
                        "do so expect nobody to cross; name the left that yields"
                    )


def _of_demand(scenario: Scenario) -> Iterator[str]:
    evaluation, periods = scenario.evaluation, scenario.demand
    begin, end = periods[0].begin, periods[-1].end
    if begin > 0:
        yield f"demand begins at {begin:g} s; until then nobody comes"
    for earlier, later in pairwise(periods):
        if later.begin > earlier.end:
            yield f"demand: nobody comes between {earlier.end:g} s and {later.begin:g} s"
    if end <= evaluation.warm_up:
        yield (
            f"demand ends at {end:g} s, before figures count (warm_up, {evaluation.warm_up:g} s); "
            "let it last as long as duration"
        )
    elif end < evaluation.duration:
        yield f"demand ends at {end:g} s, before duration ({evaluation.duration:g} s)"


def _of_evaluation(scenario: Scenario) -> Iterator[str]:
    evaluation = scenario.evaluation
    cap = scenario.intersection.speed_cap or math.inf
    for name, approach in scenario.approaches.items():
        trip = approach.length / min(approach.speed_limit, cap)
        if trip >= evaluation.duration:
            yield (
                f"evaluation.duration: a vehicle needs {trip:.0f} s to the entrance of "
                f"approaches.{name}, so nobody passes within {evaluation.duration:g} s"
            )
    rates = evaluation.penetration_rates
    twice = [f"{rate:g}" for rate, times in Counter(rates).items() if times > 1]
    if twice:
        yield f"evaluation.penetration_rates: {', '.join(twice)} stand there more than once"
    if len(rates) > MOST_RATES:
        yield (
            f"evaluation.penetration_rates: {len(rates)} rates, so a run is {len(rates)} times "
            f"{evaluation.seeds} episodes of each controller"
        )

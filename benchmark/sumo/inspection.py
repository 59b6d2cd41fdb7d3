"""What is wrong with a scenario that validates: its routes, its signal, its stopping distances."""

from collections.abc import Iterator
from dataclasses import dataclass

from benchmark.scenario.scenario import Scenario
from benchmark.sumo import demand, network, signals, webster
from benchmark.sumo.demand import TurnShare

SEEDS_ROUTED = 5  # seeds whose routes are compared with the counts


@dataclass(frozen=True)
class Inspection:
    """The findings on one scenario."""

    scenario: Scenario
    network_hash: str
    shares: list[TurnShare]
    saturation: dict[str, float]  # degree of saturation by regulated movement
    findings: list[str]  # what is wrong, in words


def inspect(scenario: Scenario) -> Inspection:
    """Build the network, route the demand and look for what is wrong.

    Raises:
        RightOfWayError: the scenario cannot be built at all, or its signal endangers.
    """
    roads = network.build(scenario)
    intersection = next(iter(roads.junctions.values())).intersection
    routes = [demand.build(scenario, roads, seed) for seed in range(1, SEEDS_ROUTED + 1)]
    shares = demand.turn_shares(scenario, roads, routes)
    saturation: dict[str, float] = {}
    if scenario.signal is not None:
        signals.check(scenario, scenario.signal, roads)
        saturation = webster.degrees_of_saturation(scenario, intersection, scenario.signal)
    findings = [
        *_of_routes(shares, "\n".join(dict.fromkeys(one.warnings for one in routes))),
        *_of_signal(scenario, saturation),
        *_of_stopping(scenario),
        *_of_time(scenario),
    ]
    return Inspection(scenario, roads.hash, shares, saturation, findings)


def _of_routes(shares: list[TurnShare], warnings: str) -> Iterator[str]:
    for share in shares:
        if share.deviates:
            yield (
                f"{share.movement}: {share.vehicles} vehicles were routed where the counts ask for "
                f"{share.expected_vehicles:.0f}"
            )
    for line in warnings.splitlines():
        if line:
            yield f"jtrrouter: {line}"


def _of_signal(scenario: Scenario, saturation: dict[str, float]) -> Iterator[str]:
    if scenario.signal is None:
        yield "no signal: traffic-light and its kin will be skipped"
    for movement, degree in saturation.items():
        if degree > 1:
            yield f"{movement}: degree of saturation {degree:.2f}; its queue grows under the signal"


def _of_stopping(scenario: Scenario) -> Iterator[str]:
    """An RV decides in the decision zone and must be able to stop there from full speed."""
    reach, step = scenario.intersection.decision_zone, scenario.evaluation.step
    cap = scenario.intersection.speed_cap
    for name, approach in scenario.approaches.items():
        speed = min(approach.speed_limit, cap) if cap else approach.speed_limit
        for kind, vehicle in scenario.vehicles.items():
            braking = speed**2 / (2 * vehicle.car_following.deceleration) + speed * step
            if braking > reach:
                yield (
                    f"approaches.{name}: a {kind} needs {braking:.0f} m to stop from {speed:g} m/s "
                    f"but decides only {reach:g} m before the entrance; "
                    f"lengthen decision_zone or set speed_cap"
                )


def _of_time(scenario: Scenario) -> Iterator[str]:
    begin = min(period.begin for period in scenario.demand)
    end = max(period.end for period in scenario.demand)
    if begin > 0:
        yield f"demand begins at {begin:g} s; until then nobody comes"
    if end < scenario.evaluation.duration:
        yield f"demand ends at {end:g} s, before duration ({scenario.evaluation.duration:g} s)"
    for name, approach in scenario.approaches.items():
        if approach.length < scenario.intersection.control_zone:
            yield (
                f"approaches.{name}: length ({approach.length:g} m) is shorter than control_zone "
                f"({scenario.intersection.control_zone:g} m); queues are cut off"
            )

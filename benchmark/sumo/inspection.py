"""What is wrong with a scenario that validates: its routes, its signal, its stopping distances."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

from benchmark.control.intersection import Movement
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import demand, network, signals, webster
from benchmark.sumo.demand import Routes
from benchmark.sumo.junction import Junction, movement_of
from benchmark.sumo.network import Network

SEEDS_ROUTED = 5  # seeds whose routes are compared with the counts


@dataclass(frozen=True, slots=True)
class TurnShare:
    """How one movement's routed vehicles compare with its turning count."""

    movement: str
    wanted: float  # share of the approach's vehicles by the counts
    realised: float  # share by the routes
    expected_vehicles: float  # by the counts
    vehicles: int  # in the routes

    @property
    def deviates(self) -> bool:
        """Whether the routes are off by more than sampling explains (four standard deviations)."""
        spread = math.sqrt(max(1.0, self.expected_vehicles))
        return abs(self.vehicles - self.expected_vehicles) > 4 * spread


@dataclass(frozen=True)
class Inspection:
    """The findings on one scenario."""

    scenario: Scenario
    network_hash: str
    shares: Mapping[str, list[TurnShare]]  # by junction
    saturation: Mapping[str, Mapping[str, float]]  # degree by junction and regulated movement
    findings: list[str]  # what is wrong, in words


def inspect(scenario: Scenario) -> Inspection:
    """Build the network, route the demand and look for what is wrong.

    Raises:
        RightOfWayError: the scenario cannot be built at all, or its signal endangers.
    """
    roads = network.build_network(scenario)
    routes = [demand.build_routes(scenario, roads, seed) for seed in range(1, SEEDS_ROUTED + 1)]
    shares = {
        name: turn_shares(scenario, junction, routes) for name, junction in roads.junctions.items()
    }
    programs = scenario.programs
    signals.check_programs(scenario, programs, roads)
    saturation = {
        name: webster.degrees_of_saturation(scenario, roads.junctions[name].intersection, signal)
        for name, signal in programs.items()
    }
    findings = [
        *_of_routes(shares, "\n".join(dict.fromkeys(drawn.warnings for drawn in routes))),
        *_of_signal(scenario, saturation),
        *_of_stopping(scenario, roads),
        *_of_time(scenario),
    ]
    return Inspection(scenario, roads.hash, shares, saturation, findings)


def turn_shares(
    scenario: Scenario, junction: Junction, routes: Sequence[Routes]
) -> list[TurnShare]:
    """Realised against wanted turn shares of a junction's movements, over all seeds given."""
    routed = Counter(
        movement_of(junction, traveller.route)
        for drawn in routes
        for traveller in drawn.travellers.values()
    )
    roads: dict[str, list[Movement]] = {}
    for movement in junction.intersection.movements.values():
        roads.setdefault(movement.approach, []).append(movement)
    shares = []
    for approach, movements in roads.items():
        expected = {
            movement.id: len(routes) * _counted(scenario, approach, movement.turn)
            for movement in sorted(movements, key=lambda movement: movement.turn)
        }
        total, all_routed = sum(expected.values()), sum(routed[name] for name in expected)
        shares += [
            TurnShare(
                movement=name,
                wanted=wanted / max(1.0, total),
                realised=routed[name] / max(1, all_routed),
                expected_vehicles=wanted,
                vehicles=routed[name],
            )
            for name, wanted in expected.items()
        ]
    return shares


def _counted(scenario: Scenario, approach: str, turn: str) -> float:
    """Vehicles that the counts ask for over all periods."""
    return sum(
        period.counts(approach).of(turn) * (period.end - period.begin) / 3600
        for period in scenario.demand
    )


def _of_routes(shares: Mapping[str, list[TurnShare]], warnings: str) -> Iterator[str]:
    for share in chain.from_iterable(shares.values()):
        if share.deviates:
            yield (
                f"{share.movement}: {share.vehicles} vehicles were routed where the counts ask for "
                f"{share.expected_vehicles:.0f}"
            )
    for line in warnings.splitlines():
        if line:
            yield f"jtrrouter: {line}"


def _of_signal(scenario: Scenario, saturation: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    if saturation.keys() < scenario.junctions.keys():
        yield "no signal: traffic-light and its kin will be skipped"
    for degrees in saturation.values():
        for movement, degree in degrees.items():
            if degree > 1:
                yield (
                    f"{movement}: degree of saturation {degree:.2f}; its queue grows under the "
                    "signal"
                )


def _of_stopping(scenario: Scenario, roads: Network) -> Iterator[str]:
    """An RV decides in the decision zone and must be able to stop there from full speed."""
    step, cap = scenario.evaluation.step, scenario.intersection.speed_cap or math.inf
    for junction in roads.junctions.values():
        reach = junction.intersection.decision_zone
        for name in junction.intersection.approaches:
            speed = min(scenario.approaches.of(name).speed_limit, cap)
            for kind, vehicle in scenario.vehicles.items():
                braking = speed**2 / (2 * vehicle.car_following.deceleration) + speed * step
                if braking > reach:
                    yield (
                        f"approaches.{name}: a {kind} needs {braking:.0f} m to stop from "
                        f"{speed:g} m/s but decides only {reach:g} m before the entrance; "
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

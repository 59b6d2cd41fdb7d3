"""What is wrong with a scenario that validates: its routes, its signal, its stopping distances."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

from benchmark.control.intersection import Intersection, Movement
from benchmark.scenario.plausibility import doubts
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import demand, network, saturation, signals, webster
from benchmark.sumo.demand import Routes
from benchmark.sumo.junction import Junction, movement_of
from benchmark.sumo.network import Network

SEEDS_ROUTED = 5  # seeds whose routes are compared with the counts
MARGIN = 0.5  # s by which yellow and all-red may be below what Webster's proposal would have


@dataclass(frozen=True, slots=True)
class TurnShare:
    """How one movement's routed vehicles compare with its turning count."""

    movement: str
    wanted: float  # share of the approach's vehicles by the counts
    realised: float  # share by the routes
    expected_vehicles: float  # by the counts, over all seeds
    vehicles: int  # in the routes of all seeds

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
    degrees = {
        name: saturation.degrees_of_saturation(scenario, roads.junctions[name].intersection, signal)
        for name, signal in programs.items()
    }
    findings = [
        *_of_routes(shares, "\n".join(dict.fromkeys(drawn.warnings for drawn in routes))),
        *_of_signal(scenario, roads, degrees),
        *_of_stopping(scenario, roads),
        *doubts(scenario),
    ]
    return Inspection(scenario, roads.hash, shares, degrees, findings)


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
                f"{share.movement}: {share.vehicles} vehicles were routed over {SEEDS_ROUTED} "
                f"seeds where the counts ask for {share.expected_vehicles:.0f}"
            )
    for line in warnings.splitlines():
        if line:
            yield f"jtrrouter: {line}"


def _of_signal(
    scenario: Scenario, roads: Network, saturation: Mapping[str, Mapping[str, float]]
) -> Iterator[str]:
    if saturation.keys() < scenario.junctions.keys():
        yield "no signal: traffic-light and its kin will be skipped"
    for name, signal in scenario.programs.items():
        intersection = roads.junctions[name].intersection
        for key, least in webster.change_times(intersection)._asdict().items():
            if (here := getattr(signal, key)) < least - MARGIN:
                yield f"signal.{key}: {here:g} s; the speed limits and ways ask for {least:.1f} s"
        yield from _of_queues(intersection, saturation[name])


def _of_queues(intersection: Intersection, degrees: Mapping[str, float]) -> Iterator[str]:
    """Movements over capacity; those of a lane group together."""
    groups: dict[tuple[str, float], list[str]] = {}
    for movement, degree in degrees.items():
        if degree > 1:
            groups.setdefault((intersection.movements[movement].approach, degree), []).append(
                movement
            )
    for (_, degree), names in groups.items():
        queues = "its queue grows" if len(names) == 1 else "their queue grows"
        yield f"{' and '.join(names)}: degree of saturation {degree:.2f}; {queues} under the signal"


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

"""The demand: the same vehicles for everybody, as many and as kind as the scenario says."""

from collections import Counter
from functools import cache
from math import sqrt
from pathlib import Path
from xml.etree import ElementTree

import pytest
from factories.scenarios import PAPER, SHIPPED, SMOKE, network_of, parsed, shipped
from hypothesis import given
from hypothesis import strategies as st

from benchmark.scenario.layout import COMPASS
from benchmark.sumo import demand, network, tools
from benchmark.sumo.demand import Routes, is_robot, unit_draw
from benchmark.sumo.inspection import turn_shares
from benchmark.sumo.junction import movement_of

RATES = st.floats(0, 1)
SEEDS = st.integers(0, 2**31)
IDS = [f"northbound.0.{number}" for number in range(4000)]


@cache
def routes_of(name: str, seed: int = 1) -> Routes:
    return demand.build_routes(shipped(name), network_of(name), seed)


def types_and_vehicles(routes: Routes) -> tuple[dict[str, dict[str, str]], list[dict[str, str]]]:
    """The attributes of vehicle types by id, and of vehicles."""
    root = ElementTree.parse(routes.path).getroot()
    types = {one.attrib["id"]: dict(one.attrib) for one in root.iter("vType")}
    return types, [dict(one.attrib) for one in root.iter("vehicle")]


def close(count: int, expected: float, draws: float | None = None) -> bool:
    """Within four standard deviations of a Poisson, or binomial, number."""
    variance = expected if draws is None else expected * (1 - expected / draws)
    return abs(count - expected) <= 4 * sqrt(variance)


@pytest.mark.parametrize("name", ["smoke/asymmetric", "smoke/tee"])
def test_the_same_seed_gives_the_same_bytes_in_a_fresh_cache(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = routes_of(name)
    monkeypatch.setenv("RIGHTOFWAY_CACHE", str(tmp_path))
    fresh = demand.build_routes(shipped(name), network_of(name), seed=1)
    assert tmp_path in fresh.path.parents
    assert fresh.path.read_bytes() == before.path.read_bytes()
    assert (fresh.hash, fresh.travellers) == (before.hash, before.travellers)


def test_another_seed_gives_other_vehicles() -> None:
    assert len({routes_of("smoke/asymmetric", seed).hash for seed in range(1, 6)}) == 5


def test_seeds_of_63_bits_give_traffic_of_their_own() -> None:
    first, second = 2**63 - 1, 2**31
    assert routes_of("smoke/tee", first).hash != routes_of("smoke/tee", second).hash
    assert [tools.sumo_seed(seed) for seed in (1, 2**31 - 1)] == [1, 2**31 - 1]
    assert all(0 <= tools.sumo_seed(seed) < 2**31 for seed in (first, second))


def test_what_does_not_drive_does_not_change_the_routes() -> None:
    changes = {"title": "Another", "signal.yellow": 3, "evaluation.warm_up": 10}
    one, other = parsed(), parsed(changes)
    assert one.hash != other.hash
    assert (
        demand.build_routes(one, network.build_network(one), 1).hash
        == demand.build_routes(other, network.build_network(other), 1).hash
    )


def test_the_order_of_classes_in_the_file_does_not_change_the_routes() -> None:
    classes = {"car": {"share": 0.5}, "van": {"share": 0.3}, "bus": {"share": 0.2, "kind": "bus"}}
    one, other = (
        parsed({"vehicles": dict(order)}) for order in (classes.items(), reversed(classes.items()))
    )
    found = network.build_network(one)
    assert (
        demand.build_routes(one, found, 1).path.read_text()
        == demand.build_routes(other, found, 1).path.read_text()
    )


@given(seed=SEEDS, vehicle=st.text(max_size=20), rates=st.tuples(RATES, RATES))
def test_a_higher_rate_only_adds_rvs(seed: int, vehicle: str, rates: tuple[float, float]) -> None:
    low, high = sorted(rates)
    assert is_robot(seed, vehicle, low) <= is_robot(seed, vehicle, high)


@given(seed=SEEDS, vehicle=st.text(max_size=20))
def test_at_rate_0_nobody_is_an_rv_and_at_rate_1_everybody(seed: int, vehicle: str) -> None:
    assert not is_robot(seed, vehicle, 0.0)
    assert is_robot(seed, vehicle, 1.0)


@pytest.mark.parametrize("rate", [0.1, 0.4, 0.9])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_share_of_rvs_is_the_rate(seed: int, rate: float) -> None:
    robots = sum(is_robot(seed, vehicle, rate) for vehicle in IDS)
    assert close(robots, rate * len(IDS), len(IDS))


def test_draws_are_uniform_and_differ_by_purpose_seed_and_vehicle() -> None:
    draws = [unit_draw("robot", 1, vehicle) for vehicle in IDS]
    assert all(
        close(sum(d < tenth / 10 for d in draws), 400 * tenth, 4000) for tenth in range(1, 10)
    )
    for other in ([unit_draw("class", 1, v) for v in IDS], [unit_draw("robot", 2, v) for v in IDS]):
        both_low = sum(a < 0.5 and b < 0.5 for a, b in zip(draws, other, strict=True))
        assert close(both_low, 1000, 4000)  # independent


@pytest.mark.parametrize("name", [*SMOKE, PAPER[0]])
def test_turns_come_in_the_shares_of_the_counts(name: str) -> None:
    scenario, seeds = shipped(name), range(1, 4 if name in PAPER else 9)
    routes = [routes_of(name, seed) for seed in seeds]
    (junction,) = network_of(name).junctions.values()
    found = Counter(movement_of(junction, t.route) for r in routes for t in r.travellers.values())
    assert set(found) == set(junction.intersection.movements)
    for movement in junction.intersection.movements.values():
        wanted = len(seeds) * sum(
            period.counts(movement.approach).of(movement.turn) * (period.end - period.begin) / 3600
            for period in scenario.demand
        )
        assert close(found[movement.id], wanted), movement.id
    (junction,) = network_of(name).junctions.values()
    shares = {share.movement: share for share in turn_shares(scenario, junction, routes)}
    assert {name: one.vehicles for name, one in shares.items()} == dict(found)
    assert not any(one.deviates for one in shares.values())
    approaches = len(scenario.approaches.names())
    assert sum(one.wanted for one in shares.values()) == pytest.approx(approaches)
    assert sum(one.realised for one in shares.values()) == pytest.approx(approaches)


@pytest.mark.parametrize("name", SHIPPED)
def test_every_vehicle_drives_from_an_approach_through_the_intersection_to_an_exit(
    name: str,
) -> None:
    (junction,) = network_of(name).junctions.values()
    routes, approaches = routes_of(name), dict(shipped(name).approaches.items())
    assert routes.travellers
    assert routes.warnings == ""
    for traveller in routes.travellers.values():
        movement = junction.intersection.movements[movement_of(junction, traveller.route) or ""]
        entry = f"{movement.approach}.upstream" if approaches[movement.approach].has_bay else ""
        assert traveller.id.startswith(f"{movement.approach}.")
        assert traveller.route[0] == (entry or movement.approach)
        assert movement.exit in traveller.route[-2:]


@pytest.mark.parametrize("name", SHIPPED)
def test_vehicles_depart_within_the_periods(name: str) -> None:
    periods = shipped(name).demand
    for traveller in routes_of(name).travellers.values():
        period = periods[int(traveller.id.split(".")[1])]
        assert period.begin <= traveller.depart <= period.end


def test_between_periods_and_where_nothing_is_counted_nobody_departs() -> None:
    counts = {"left": 900, "cross": 900, "right": 900}
    early = {"begin": 0, "end": 60, "northbound": counts}
    late = {"begin": 120, "end": 180, **dict.fromkeys(COMPASS, counts)}
    scenario = parsed({"demand": [early, late]})
    travellers = demand.build_routes(
        scenario, network.build_network(scenario), 1
    ).travellers.values()
    assert {one.id.split(".")[0] for one in travellers if one.depart <= 60} == {"northbound"}
    assert {one.id.split(".")[0] for one in travellers if one.depart >= 120} == set(COMPASS)
    assert not any(60 < one.depart < 120 for one in travellers)


def test_vehicles_of_the_last_seconds_of_a_period_turn_by_its_counts() -> None:
    mostly = {"left": 2, "cross": 1000, "right": 2}
    changes = {f"approaches.{name}.length": 500 for name in COMPASS}
    changes |= {f"approaches.{name}.bay": 30 for name in COMPASS}
    scenario = parsed({**changes, **{f"demand.0.{name}": mostly for name in COMPASS}})
    found = network.build_network(scenario)
    (junction,) = found.junctions.values()
    turns = Counter(
        (movement_of(junction, traveller.route) or "?")[-1]
        for seed in range(1, 6)
        for traveller in demand.build_routes(scenario, found, seed).travellers.values()
    )
    assert turns["C"] > 0.98 * turns.total()


def test_classes_come_in_their_shares() -> None:
    classes = Counter(
        traveller.vehicle_class
        for seed in range(1, 9)
        for traveller in routes_of("smoke/asymmetric", seed).travellers.values()
    )
    assert set(classes) == {"car", "truck"}
    assert close(classes["truck"], 0.1 * classes.total(), classes.total())


def test_speed_factors_lie_within_two_deviations_of_one() -> None:
    factors = [
        float(vehicle["speedFactor"]) for vehicle in types_and_vehicles(routes_of(PAPER[0]))[1]
    ]
    assert min(factors) == pytest.approx(0.8, abs=0.02)
    assert min(factors) >= 0.8
    assert max(factors) == pytest.approx(1.2, abs=0.02)
    assert max(factors) <= 1.2
    assert sum(factors) / len(factors) == pytest.approx(1.0, abs=0.015)
    assert len(set(factors)) > len(factors) / 2


def test_without_deviation_all_drivers_want_the_speed_limit() -> None:
    demand.build_routes(
        parsed(), network.build_network(parsed()), 1
    )  # a cached neighbour must not be taken
    scenario = parsed({"vehicles.car.speed_deviation": 0})
    _, vehicles = types_and_vehicles(
        demand.build_routes(scenario, network.build_network(scenario), 1)
    )
    assert vehicles
    assert {float(vehicle["speedFactor"]) for vehicle in vehicles} == {1.0}


def test_a_class_becomes_a_vehicle_type_with_its_driver() -> None:
    driver = {"model": "Krauss", "acceleration": 1.2, "deceleration": 4, "imperfection": 0.3}
    driver |= {"headway": 1.5, "minimum_gap": 3}
    scenario = parsed(
        {"vehicles": {"lorry": {"share": 1, "kind": "truck", "length": 9, "car_following": driver}}}
    )
    types, vehicles = types_and_vehicles(
        demand.build_routes(scenario, network.build_network(scenario), 1)
    )
    lorry = types.pop("lorry")
    assert types == {}
    assert {vehicle["type"] for vehicle in vehicles} == {"lorry"}
    assert (lorry.pop("vClass"), lorry.pop("carFollowModel")) == ("truck", "Krauss")
    numbers = {"accel": 1.2, "decel": 4, "tau": 1.5, "minGap": 3, "sigma": 0.3}
    numbers |= {"length": 9, "maxSpeed": 10}
    assert {key: float(value) for key, value in lorry.items() if key != "id"} == numbers


def test_trucks_come_from_the_approach_that_has_them() -> None:
    kinds = {"car": {"share": 0.9}, "truck": {"share": 0.1, "kind": "truck"}}
    shares = {f"approaches.{name}.heavy_vehicles": 0.0 for name in COMPASS[1:]}
    changes = {"vehicles": kinds, **shares, "approaches.northbound.heavy_vehicles": 1.0}
    scenario = parsed(changes)
    drawn = demand.build_routes(scenario, network.build_network(scenario), 1).travellers.values()
    by_approach = {(each.id.partition(".")[0], each.vehicle_class) for each in drawn}
    assert by_approach == {
        ("northbound", "truck"),
        *((name, "car") for name in COMPASS[1:]),
    }

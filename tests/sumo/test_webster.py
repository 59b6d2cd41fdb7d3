"""Webster's method against values worked out by hand, and proposals that can be driven."""

import math
from typing import Any

import pytest
from factories.scenarios import PAPER, SHIPPED, network_of, parsed, shipped
from factories.traffic import CROSSROADS
from scipy.optimize import minimize_scalar

from benchmark.control.intersection import Intersection
from benchmark.scenario.layout import COMPASS
from benchmark.scenario.scenario import CENTRE, Scenario
from benchmark.scenario.signal import Signal
from benchmark.sumo import signals, webster
from benchmark.sumo.webster import LaneGroup

KRAUSS = {"model": "Krauss", "headway": 1.0, "minimum_gap": 2.5}

PERMITTED = [
    {"movements": ["N-C", "N-L", "S-C", "S-L"], "permitted": ["N-L", "S-L"], "green": 30},
    {"movements": ["E-C", "E-L", "W-C", "W-L"], "permitted": ["E-L", "W-L"], "green": 30},
]


def counted(signal: Any = None, **counts: float) -> tuple[Scenario, Signal]:
    """The crossroads R C C L with counts by movement [veh/h], as in ``N_C=600``; others are 10."""
    changes: dict[str, Any] = {"vehicles.car": {"share": 1, "length": 5, "car_following": KRAUSS}}
    for approach in COMPASS:
        letter = approach[0].upper()
        changes[f"approaches.{approach}.lanes"] = "R C C L"
        changes[f"demand.0.{approach}"] = {
            turn: counts.get(f"{letter}_{turn[0].upper()}", 10)
            for turn in ("left", "cross", "right")
        }
    scenario = parsed(changes | ({"signal": signal} if signal else {}))
    assert scenario.signal is not None
    return scenario, scenario.signal


def saturation() -> float:
    """What a lane of the crossroads discharges under Krauss [veh/h]; the same for all turns."""
    return webster.saturation_flow(counted()[0], CROSSROADS.movements["N-C"])


def test_saturation_under_krauss_is_one_vehicle_per_gap_and_length_at_the_speed_cap() -> None:
    by_hand = 3600 * 10 / (2.5 + 1.0 * 10 + 5)  # m/s over m
    assert saturation() == pytest.approx(by_hand, rel=0.005)


def test_saturation_under_idm_is_the_greatest_equilibrium_flow() -> None:
    car = {"share": 1, "length": 5, "car_following": {"model": "IDM", "headway": 1.2}}
    scenario = parsed({"vehicles.car": car})

    def negative_flow(speed: float) -> float:
        return -speed / ((2.5 + 1.2 * speed) / math.sqrt(1 - (speed / 10) ** 4) + 5)

    best = minimize_scalar(negative_flow, bounds=(0.1, 9.99), method="bounded")
    found = webster.saturation_flow(scenario, CROSSROADS.movements["N-C"])
    assert found == pytest.approx(-3600 * best.fun, rel=1e-3)


def test_a_slow_way_limits_saturation() -> None:
    movement = CROSSROADS.movements["N-L"]
    way = movement.ways[0]
    slow = type(way)(way.lane, way.exit_lane, way.length, 5.0, ())
    slowed = type(movement)("N-L", "northbound", "L", movement.exit, (slow,), movement.conflicts)
    assert webster.saturation_flow(counted()[0], slowed) == pytest.approx(
        3600 * 5 / (2.5 + 5 + 5), rel=0.005
    )


def test_classes_mix_by_the_time_they_take() -> None:
    classes = {
        "car": {"share": 0.8, "length": 5, "car_following": KRAUSS},
        "bus": {"share": 0.2, "length": 12, "car_following": {**KRAUSS, "headway": 2.0}},
    }
    headway = 0.8 * (2.5 + 10 + 5) / 10 + 0.2 * (2.5 + 20 + 12) / 10  # s
    found = webster.saturation_flow(parsed({"vehicles": classes}), CROSSROADS.movements["N-C"])
    assert found == pytest.approx(3600 / headway, rel=0.005)


def by_flow_ratios(north: float, lefts: float, east: float) -> tuple[Scenario, Signal]:
    """Counts that give critical flow ratios; cross movements have two lanes, lefts one."""
    one = saturation()
    return counted(
        N_C=2 * one * north,
        S_C=one * north,
        E_C=2 * one * east,
        W_C=one * east,
        **dict.fromkeys(("N_L", "S_L", "E_L", "W_L"), one * lefts),
    )


def test_cycle_and_splits_are_websters() -> None:
    scenario, signal = by_flow_ratios(north=0.3, lefts=0.05, east=0.15)
    timed = webster.retimed(scenario, CROSSROADS, signal)
    # L = 4 * (4 + 1) = 20 s, Y = 0.55, C = (1.5 * 20 + 5) / (1 - 0.55) = 77.8 s,
    # greens = 57.8 * y / 0.55 = 5.25, 31.5, 5.25 and 15.8 s, to whole seconds, never under 5
    assert [phase.green for phase in timed.phases] == [5, 32, 5, 16]
    assert timed.cycle == 78
    assert timed.kind == "fixed"
    assert [phase.name for phase in timed.phases] == [phase.name for phase in signal.phases]
    assert (timed.yellow, timed.all_red) == (signal.yellow, signal.all_red)


def test_degrees_of_saturation_are_demand_over_capacity() -> None:
    scenario, signal = by_flow_ratios(north=0.3, lefts=0.05, east=0.15)
    degrees = webster.degrees_of_saturation(scenario, CROSSROADS, signal)
    cycle = 10 + 20 + 10 + 20 + 4 * 5  # s
    by_hand = {"N-C": 0.3 * cycle / 20, "S-C": 0.15 * cycle / 20, "E-C": 0.15 * cycle / 20}
    by_hand |= {"W-C": 0.075 * cycle / 20}
    by_hand |= dict.fromkeys(("N-L", "S-L", "E-L", "W-L"), 0.05 * cycle / 10)
    assert degrees == pytest.approx(by_hand)


def test_a_movement_that_is_green_twice_has_both_greens() -> None:
    phases = [
        {"movements": ["N-C", "N-L"], "green": 10},
        {"movements": ["N-C", "S-C"], "green": 20},
        {"movements": ["S-C", "S-L"], "green": 10},
        {"movements": ["E-C", "E-L"], "green": 10},
        {"movements": ["W-C", "W-L"], "green": 10},
    ]
    signal = {"yellow": 3, "all_red": 1, "phases": phases}
    scenario, found = counted(signal, N_C=2 * 0.3 * saturation())
    degrees = webster.degrees_of_saturation(scenario, CROSSROADS, found)
    assert degrees["N-C"] == pytest.approx(0.3 * (60 + 5 * 4) / 30)


def test_a_permitted_left_filters_through_the_gaps_of_its_opponents() -> None:
    scenario, signal = counted({"phases": PERMITTED}, N_L=100, S_C=720)
    opposing = 720 / 3600  # veh/s
    capacity = 3600 * opposing * math.exp(-opposing * 4.5) / (1 - math.exp(-opposing * 2.5))
    degrees = webster.degrees_of_saturation(scenario, CROSSROADS, signal)
    assert degrees["N-L"] == pytest.approx(100 / capacity * signal.cycle / 30)
    assert degrees["S-C"] == pytest.approx(720 / 2 / saturation() * signal.cycle / 30)


@pytest.mark.parametrize("ratio", [0.225, 0.24, 0.5], ids=["Y = 0.9", "Y = 0.96", "Y = 2"])
def test_a_saturated_crossing_has_the_longest_cycle(ratio: float) -> None:
    scenario, signal = by_flow_ratios(north=ratio, lefts=ratio, east=ratio)
    assert webster.retimed(scenario, CROSSROADS, signal).cycle == pytest.approx(180, abs=2)


def test_a_quiet_crossing_has_the_shortest_cycle() -> None:
    scenario, signal = counted({"phases": PERMITTED})
    assert webster.retimed(scenario, CROSSROADS, signal).cycle == 40


def test_more_demand_gives_a_longer_cycle() -> None:
    cycles = []
    for scale in (0.5, 1.0, 1.5, 2.0, 2.5):
        scenario, signal = by_flow_ratios(0.15 * scale, 0.05 * scale, 0.1 * scale)
        cycles.append(webster.retimed(scenario, CROSSROADS, signal).cycle)
    assert cycles == sorted(set(cycles))


def test_the_peak_period_counts() -> None:
    quiet, busy = ({"left": 1, "cross": count, "right": 1} for count in (100, 300))
    periods = [
        {"begin": 60 * index, "end": 60 * index + 60, **dict.fromkeys(COMPASS, counts)}
        for index, counts in enumerate([quiet, busy, quiet])
    ]
    scenario = parsed({"demand": periods})
    assert scenario.peak.begin == 60
    assert webster.count(scenario, CROSSROADS, "N-C") == 300


def groups_of(name: str) -> list[LaneGroup]:
    return webster.lane_groups(intersection_of(name))


def intersection_of(name: str) -> Intersection:
    return network_of(name).junctions["intersection"].intersection


def test_movements_that_share_a_lane_are_one_group() -> None:
    assert groups_of("smoke/crossing") == [
        LaneGroup((f"{letter}-C", f"{letter}-L"), 1) for letter in "ENSW"
    ]
    assert groups_of("smoke/asymmetric") == [
        *(LaneGroup(("E-C",), 1), LaneGroup(("E-L",), 1), LaneGroup(("N-C",), 2)),
        *(LaneGroup(("N-L",), 1), LaneGroup(("S-C", "S-L"), 2), LaneGroup(("W-C", "W-L"), 1)),
    ]


def test_a_shared_lane_carries_the_flow_ratios_of_its_movements() -> None:
    name = "smoke/crossing"
    scenario, intersection = shipped(name), intersection_of(name)
    group = groups_of(name)[1]
    phase = webster.propose_program(scenario, intersection_of(name)).phases[0]
    assert phase.movements == group.movements == ("N-C", "N-L")
    assert phase.permitted == ()
    by_hand = sum(
        scenario.demand[0].northbound.of(movement[-1])
        / webster.saturation_flow(scenario, intersection.movements[movement])
        for movement in group.movements
    )
    assert group.flow_ratio(scenario, intersection, phase) == pytest.approx(by_hand)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_proposal_lets_every_movement_go_safely(name: str) -> None:
    scenario = shipped(name)
    signal = webster.propose_program(scenario, intersection_of(name))
    signals.check_programs(scenario, {CENTRE: signal}, network_of(name))
    assert Signal.model_validate(signal.model_dump()) == signal
    green = {movement for phase in signal.phases for movement in phase.movements}
    assert green == set(intersection_of(name).regulated_movements)
    assert 3 <= signal.yellow <= 5
    assert 1 <= signal.all_red <= 2
    assert signal.cycle <= webster.LONGEST_CYCLE + len(signal.phases)


@pytest.mark.parametrize("name", PAPER)
def test_a_proposal_is_retimed_to_itself(name: str) -> None:
    signal = webster.propose_program(shipped(name), intersection_of(name))
    assert webster.retimed(shipped(name), intersection_of(name), signal) == signal

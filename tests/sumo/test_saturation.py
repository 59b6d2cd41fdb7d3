"""Saturation flows, lane groups and degrees of saturation against values worked out by hand."""

import math
from typing import Any

import pytest
from factories.counts import KRAUSS, PERMITTED, by_flow_ratios, counted, lane_saturation
from factories.discharge import discharge, saturated
from factories.scenarios import network_of, parsed, shipped
from factories.traffic import CROSSROADS
from scipy.optimize import minimize_scalar

from benchmark.control.intersection import Intersection
from benchmark.scenario.layout import COMPASS
from benchmark.sumo.network import build_network
from benchmark.sumo.saturation import (
    LaneGroup,
    Loading,
    count,
    degrees_of_saturation,
    filtering_flow,
    lane_groups,
    saturation_flow,
)


def intersection_of(name: str) -> Intersection:
    return network_of(name).junctions["intersection"].intersection


def test_saturation_under_krauss_is_one_vehicle_per_gap_and_length_at_the_speed_cap() -> None:
    by_hand = 3600 * 10 / (2.5 + 1.0 * 10 + 5)  # m/s over m
    assert lane_saturation() == pytest.approx(by_hand, rel=0.005)


def test_saturation_under_idm_is_the_greatest_equilibrium_flow() -> None:
    car = {"share": 1, "length": 5, "car_following": {"model": "IDM", "headway": 1.2}}
    scenario = parsed({"vehicles.car": car})

    def negative_flow(speed: float) -> float:
        return -speed / ((2.5 + 1.2 * speed) / math.sqrt(1 - (speed / 10) ** 4) + 5)

    best = minimize_scalar(negative_flow, bounds=(0.1, 9.99), method="bounded")
    found = saturation_flow(scenario, CROSSROADS.movements["N-C"])
    assert found == pytest.approx(-3600 * best.fun, rel=1e-3)


def test_a_slow_way_limits_saturation() -> None:
    movement = CROSSROADS.movements["N-L"]
    way = movement.ways[0]
    slow = type(way)(way.lane, way.exit_lane, way.length, 5.0, ())
    slowed = type(movement)("N-L", "northbound", "L", movement.exit, (slow,), movement.conflicts)
    assert saturation_flow(counted()[0], slowed) == pytest.approx(
        3600 * 5 / (2.5 + 5 + 5), rel=0.005
    )


def test_classes_mix_by_the_time_they_take() -> None:
    classes = {
        "car": {"share": 0.8, "length": 5, "car_following": KRAUSS},
        "bus": {"share": 0.2, "length": 12, "car_following": {**KRAUSS, "headway": 2.0}},
    }
    headway = 0.8 * (2.5 + 10 + 5) / 10 + 0.2 * (2.5 + 20 + 12) / 10  # s
    found = saturation_flow(parsed({"vehicles": classes}), CROSSROADS.movements["N-C"])
    assert found == pytest.approx(3600 / headway, rel=0.005)


def test_degrees_of_saturation_are_demand_over_capacity() -> None:
    scenario, signal = by_flow_ratios(north=0.3, lefts=0.05, east=0.15)
    degrees = degrees_of_saturation(scenario, CROSSROADS, signal)
    cycle = 10 + 20 + 10 + 20 + 4 * 5  # s
    by_hand = {"N-C": 0.3 * cycle / 20, "S-C": 0.15 * cycle / 20, "E-C": 0.15 * cycle / 20}
    by_hand |= {"W-C": 0.075 * cycle / 20}
    by_hand |= dict.fromkeys(("N-L", "S-L", "E-L", "W-L"), 0.05 * cycle / 10)
    regulated = {name: degree for name, degree in degrees.items() if not name.endswith("R")}
    assert regulated == pytest.approx(by_hand)


def test_a_movement_that_is_green_twice_has_both_greens() -> None:
    phases = [
        {"movements": ["N-C", "N-L"], "green": 10},
        {"movements": ["N-C", "S-C"], "green": 20},
        {"movements": ["S-C", "S-L"], "green": 10},
        {"movements": ["E-C", "E-L"], "green": 10},
        {"movements": ["W-C", "W-L"], "green": 10},
    ]
    signal = {"yellow": 3, "all_red": 1, "phases": phases}
    scenario, found = counted(signal, N_C=2 * 0.3 * lane_saturation())
    degrees = degrees_of_saturation(scenario, CROSSROADS, found)
    assert degrees["N-C"] == pytest.approx(0.3 * (60 + 5 * 4) / 30)


def test_a_permitted_left_filters_through_the_gaps_of_its_opponents() -> None:
    scenario, signal = counted({"phases": PERMITTED}, N_L=100, S_C=720)
    opposing = 720 / 3600  # veh/s
    capacity = 3600 * opposing * math.exp(-opposing * 4.5) / (1 - math.exp(-opposing * 2.5))
    degrees = degrees_of_saturation(scenario, CROSSROADS, signal)
    assert degrees["N-L"] == pytest.approx(100 / capacity * signal.cycle / 30)
    assert degrees["S-C"] == pytest.approx(720 / 2 / lane_saturation() * signal.cycle / 30)


def test_the_busiest_quarter_of_an_hour_counts() -> None:
    quiet, busy = ({"left": 1, "cross": number, "right": 1} for number in (100, 300))
    periods = [
        {"begin": 600 * index, "end": 600 * index + 600, **dict.fromkeys(COMPASS, counts)}
        for index, counts in enumerate([quiet, busy, quiet])
    ]
    scenario = parsed({"demand": periods})
    assert scenario.peak.begin == 600
    assert count(scenario, CROSSROADS, "N-C") == pytest.approx((600 * 300 + 300 * 100) / 900)


def groups(name: str) -> dict[tuple[str, ...], list[str]]:
    """The lanes of each lane group, by its movements."""
    return {
        group.movements: sorted(" ".join(sorted(lane)) for lane in group.lanes)
        for group in lane_groups(shipped(name), intersection_of(name))
    }


def test_movements_that_share_a_lane_are_one_group_right_turns_too() -> None:
    assert groups("smoke/crossing") == {
        (f"{letter}-C", f"{letter}-L", f"{letter}-R"): [f"{letter}-C {letter}-L {letter}-R"]
        for letter in "ENSW"
    }
    assert groups("smoke/asymmetric") == {
        ("E-C", "E-R"): ["E-C E-R"],
        ("E-L",): ["E-L"],
        ("N-C",): ["N-C", "N-C"],
        ("N-L",): ["N-L"],
        ("N-R",): ["N-R"],
        ("S-C", "S-L"): ["S-C", "S-C S-L"],
        ("S-R",): ["S-R"],
        ("W-C", "W-L", "W-R"): ["W-C W-L W-R"],
    }


@pytest.mark.parametrize(
    ("lanes", "asked", "loads"),
    [
        ("R", {"R": 0.7}, {"R": 0.7}),
        ("RC", {"R": 0.5, "C": 0.2}, {"R": 0.7, "C": 0.7}),
        ("RC C", {"R": 0.2, "C": 1.0}, {"R": 0.6, "C": 0.6}),  # even lanes
        ("RC C", {"R": 0.9, "C": 0.3}, {"R": 0.9, "C": 0.3}),  # C leaves the shared lane to R
        ("RC C CL", {"R": 0.9, "C": 0.6, "L": 0.1}, {"R": 0.9, "C": 0.35, "L": 0.35}),
        ("RCL", {"R": 0.1, "C": 0.0, "L": 0.3}, {"R": 0.4, "C": 0.4, "L": 0.4}),
    ],
)
def test_drivers_choose_lanes_so_that_the_busiest_carries_least(
    lanes: str, asked: dict[str, float], loads: dict[str, float]
) -> None:
    group = LaneGroup(tuple(asked), tuple(frozenset(lane) for lane in lanes.split()))
    assert group.loads(asked) == pytest.approx(loads)


SHARED = {f"approaches.{name}.lanes": "RC" for name in COMPASS} | {
    "demand.0": {"begin": 0, "end": 60}
    | {name: {"left": 0, "cross": 300, "right": 50} for name in ("eastbound", "westbound")}
    | {
        "northbound": {"left": 0, "cross": 50, "right": 1300},
        "southbound": {"left": 0, "cross": 50, "right": 100},
    },
    "signal": {
        "yellow": 3.0,
        "phases": [
            {"movements": ["E-C", "W-C"], "green": 26},
            {"movements": ["N-C", "S-C"], "green": 26},
        ],
    },
}


def degrees(changes: dict[str, Any]) -> dict[str, float]:
    scenario = parsed(changes)
    assert scenario.signal is not None
    intersection = build_network(scenario).junctions["intersection"].intersection
    return degrees_of_saturation(scenario, intersection, scenario.signal)


def test_right_turns_load_the_lane_that_they_share() -> None:
    found = degrees(SHARED)
    assert found["N-R"] == found["N-C"] == pytest.approx(1.68, abs=0.01)
    assert found["E-C"] == pytest.approx(0.51, abs=0.01)


def test_right_turns_that_wait_for_green_load_it_more() -> None:
    found = degrees(SHARED | {"approaches.northbound.right_on_red": False})
    assert found["N-R"] == pytest.approx(2.4, abs=0.1)
    assert found["S-R"] == degrees(SHARED)["S-R"]


def test_right_turns_on_a_lane_of_their_own_filter_into_the_traffic_of_their_exit() -> None:
    """Every exit of the crossroads is one movement's alone, so nothing stops them on red."""
    scenario, signal = counted(N_R=500)
    loading = Loading(scenario, CROSSROADS, signal)
    green = 10 + 20  # s of 80: the phases of its approach
    assert loading.turned_on_red("N-R") == pytest.approx(500)  # 3600 / 3.3 * 50 / 80 = 682
    busier = Loading(counted(N_R=1000)[0], CROSSROADS, signal)
    assert busier.turned_on_red("N-R") == pytest.approx(3600 / 3.3 * (80 - green) / 80)
    capacity = lane_saturation() * green / 80 + 3600 / 3.3 * 50 / 80
    assert busier.degrees()["N-R"] == pytest.approx(1000 / capacity)


def test_what_filters_falls_with_the_stream_that_it_filters_into() -> None:
    flows = [filtering_flow(stream, 6.2, 3.3) for stream in (0, 1, 300, 900, 3000)]
    assert flows[:2] == pytest.approx([3600 / 3.3] * 2, rel=0.01)
    assert flows[2] == pytest.approx(744, abs=1)
    assert flows == sorted(flows, reverse=True)


def test_a_slip_lane_passes_beside_the_signal() -> None:
    assert "N-R" not in degrees({"approaches.northbound.slip_lane": True})


def test_a_queue_of_the_papers_drivers_discharges_at_saturation_flow() -> None:
    scenario = saturated(10.0, 26.0, {"model": "IDM", "headway": 1.0}, duration=900.0)
    (intersection,) = build_network(scenario).intersections
    formula = saturation_flow(scenario, intersection.movements["N-C"])
    assert discharge(scenario, 26.0) == pytest.approx(formula, rel=0.1)

"""Lengths, speeds, times and shares as people write them."""

from typing import Any

import pytest
from factories.scenarios import edited, parsed

from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.scenario import json_schema

NORTH = "approaches.northbound"


@pytest.mark.parametrize(
    ("path", "text", "number"),
    [
        (f"{NORTH}.speed_limit", "30 mph", 13.4112),
        (f"{NORTH}.speed_limit", "50 km/h", 13.888888889),
        (f"{NORTH}.speed_limit", "13.89 m/s", 13.89),
        (f"{NORTH}.length", "350 ft", 106.68),
        (f"{NORTH}.length", "0.1 km", 100.0),
        (f"{NORTH}.bay", "100ft", 30.48),
        ("intersection.control_zone", "300 ft", 91.44),
        ("intersection.speed_cap", "22 mph", 9.83488),
        ("intersection.radius", "12 ft", 3.6576),
        ("evaluation.duration", "15 min", 900.0),
        ("evaluation.warm_up", "0.5 min", 30.0),
        ("signal.yellow", "3.5 s", 3.5),
        ("vehicles.car.length", "16 ft", 4.8768),
        ("evaluation.penetration_rates", ["40%", "55 %"], [0.4, 0.55]),
        ("vehicles.car.share", "100 %", 1.0),
    ],
)
def test_a_text_with_a_unit_is_the_same_scenario_as_its_number(
    path: str, text: Any, number: Any
) -> None:
    assert parsed({path: text}).hash == parsed({path: number}).hash
    assert parsed({path: text}).model_dump() == parsed({path: number}).model_dump()


@pytest.mark.parametrize(
    ("path", "text", "words"),
    [
        (f"{NORTH}.speed_limit", "30 ft", "unknown unit \"ft\" in '30 ft'; expected one of m/s"),
        (f"{NORTH}.speed_limit", "fast", 'expected a number, or a text such as "30 mph"'),
        (f"{NORTH}.length", "", 'expected a number, or a text such as "12 ft"'),
        (f"{NORTH}.length", "-3 ft", "greater than 0"),
        (f"{NORTH}.length", "1e9 mi", "less than or equal to 5000"),
        (f"{NORTH}.length", "12", "expected a number"),
        ("evaluation.duration", "15 minutes", 'unknown unit "minutes"'),
        ("evaluation.penetration_rates", ["140 %"], "less than or equal to 1"),
        ("evaluation.penetration_rates", ["many"], "expected a number"),
    ],
)
def test_a_text_that_is_no_quantity_is_refused_with_the_units(
    path: str, text: Any, words: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        parsed({path: text})
    assert path in str(caught.value)
    assert words in str(caught.value)


def test_editors_learn_that_both_are_taken() -> None:
    zone = json_schema()["$defs"]["Zones"]["properties"]["control_zone"]
    assert {"number", "string"} == {choice["type"] for choice in zone["anyOf"]}


def test_the_peak_hour_factor_raises_the_flow_to_that_of_the_busiest_quarter() -> None:
    scenario = parsed({"demand.0.peak_hour_factor": 0.8})
    assert scenario.demand[0].counts("northbound").cross == 250
    assert scenario.peak_demand == pytest.approx(parsed().peak_demand / 0.8)
    assert scenario.at_demand(700).peak_demand == pytest.approx(700)
    assert parsed({"demand.0.peak_hour_factor": 1.0}).hash == parsed().hash != scenario.hash


@pytest.mark.parametrize("factor", [0.2, 1.1])
def test_no_hour_has_another_peak_hour_factor(factor: float) -> None:
    with pytest.raises(ScenarioError, match=r"demand\[0\]\.peak_hour_factor"):
        parsed({"demand.0.peak_hour_factor": factor})


MIXED = {
    "vehicles": {
        "car": {"share": 0.8},
        "bus": {"share": 0.05, "kind": "bus"},
        "truck": {"share": 0.15, "kind": "truck"},
    }
}


def test_an_approach_has_its_own_share_of_heavy_vehicles() -> None:
    scenario = parsed(MIXED | {f"{NORTH}.heavy_vehicles": "40 %"})
    assert scenario.class_shares("northbound") == pytest.approx(
        {"car": 0.6, "bus": 0.1, "truck": 0.3}
    )
    assert scenario.class_shares("eastbound") == pytest.approx(
        {"car": 0.8, "bus": 0.05, "truck": 0.15}
    )
    assert scenario.hash != parsed(MIXED).hash
    assert parsed(MIXED | {f"{NORTH}.heavy_vehicles": 0}).class_shares("northbound")["car"] == 1


@pytest.mark.parametrize(("vehicles", "share"), [({"car": {"share": 1}}, 0.1)])
def test_heavy_vehicles_need_a_class(vehicles: Any, share: float) -> None:
    with pytest.raises(ScenarioError, match=r"northbound\.heavy_vehicles: 0\.1, but no vehicle"):
        parsed({"vehicles": vehicles, f"{NORTH}.heavy_vehicles": share})


def test_files_without_the_keys_keep_their_hash() -> None:
    document = edited()
    assert "heavy_vehicles" not in str(document)
    assert parsed({f"{NORTH}.right_on_red": True}).hash == parsed().hash

"""What is wrong with a scenario that validates, in words."""

import re
from typing import Any

import pytest
from factories.scenarios import DROP, parsed, smoke

from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import inspection

APPROACHES = ("northbound", "eastbound", "southbound", "westbound")
FAST = {"intersection.speed_cap": DROP}  # 13.89 m/s; 13.89^2 / (2 * 4.5) + 13.89 = 35.3 m
HALF_TRUCKS = {
    "vehicles.car": {"share": 0.5},
    "vehicles.truck": {"share": 0.5, "car_following": {"model": "Krauss", "deceleration": 2.0}},
}  # at the cap, 10^2 / (2 * 2) + 10 = 35 m
STREAM = {"demand.0.northbound": {"left": 10, "cross": 3000, "right": 10}}


@pytest.fixture(autouse=True)
def _few_routes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inspection, "SEEDS_ROUTED", 2)


def findings(changes: dict[str, Any] | None = None) -> list[str]:
    return inspection.inspect(parsed(changes)).findings


@pytest.mark.parametrize(
    "scenario",
    [smoke("crossing").with_demand(0.3), smoke("tee").with_demand(0.3), parsed()],
    ids=lambda scenario: scenario.name,
)
def test_a_sound_scenario_has_no_findings(scenario: Scenario) -> None:
    assert inspection.inspect(scenario).findings == []


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"demand.0.end": 40}, ["demand ends at 40 s, before duration (60 s)"]),
        ({"demand.0.end": 90}, []),
        ({"signal": DROP}, ["no signal: traffic-light and its kin will be skipped"]),
        (
            {"approaches.northbound.length": 99.5},
            [
                "approaches.northbound: length (99.5 m) is shorter than control_zone (100 m); "
                "queues are cut off"
            ],
        ),
        ({"approaches.northbound.length": 99.5, "intersection.control_zone": 99.5}, []),
        (
            FAST | {"approaches.westbound.speed_limit": 16},
            [
                f"approaches.{name}: a car needs {stop} m to stop from {speed} m/s but decides "
                "only 30 m before the entrance; lengthen decision_zone or set speed_cap"
                for name, stop, speed in zip(
                    APPROACHES, [35, 35, 35, 44], ["13.89"] * 3 + ["16"], strict=True
                )
            ],
        ),
        (FAST | {"evaluation.step": 0.25}, []),
        (FAST | {"intersection.decision_zone": 36}, []),
        (
            FAST
            | {"signal.all_red": 1.5}
            | {f"approaches.{name}.speed_limit": 12.5 for name in APPROACHES},
            [],
        ),
        (
            HALF_TRUCKS,
            [
                f"approaches.{name}: a truck needs 35 m to stop from 10 m/s but decides "
                "only 30 m before the entrance; lengthen decision_zone or set speed_cap"
                for name in APPROACHES
            ],
        ),
    ],
)
def test_what_is_wrong_is_said_with_the_figures(changes: dict[str, Any], found: list[str]) -> None:
    assert findings(changes) == found


def test_movements_with_more_traffic_than_their_green_are_said() -> None:
    found = inspection.inspect(parsed(STREAM))
    assert [name for name, degree in found.saturation["intersection"].items() if degree > 1] == [
        "N-C"
    ]
    degree = f"{found.saturation['intersection']['N-C']:.2f}"
    assert found.findings == [
        f"N-C: degree of saturation {degree}; its queue grows under the signal"
    ]


def test_all_that_is_wrong_is_said_at_once() -> None:
    both = {"demand.0.end": 40, "approaches.southbound.length": 60}
    first, *others = findings(STREAM | FAST | both)
    assert first.startswith("N-C: degree of saturation")
    assert others == [
        *findings(FAST),
        *findings({"approaches.southbound.length": 60}),
        *findings({"demand.0.end": 40}),
    ]


def test_demand_ends_with_its_last_period() -> None:
    first, *_ = parsed().model_dump(mode="json")["demand"]
    periods = [{**first, "end": 30}, {**first, "begin": 30}]
    assert findings({"demand": periods}) == []
    assert findings({"demand": periods[:1]}) == ["demand ends at 30 s, before duration (60 s)"]


def test_an_inspection_says_how_saturated_and_how_well_routed_each_movement_is() -> None:
    scenario = smoke("tee").with_demand(0.3)
    found = inspection.inspect(scenario)
    movements = {"N-L", "N-R", "E-C", "E-R", "W-C", "W-L"}
    assert found.saturation["intersection"].keys() == movements
    assert all(0 < degree < 1 for degree in found.saturation["intersection"].values())
    assert {share.movement for share in found.shares["intersection"]} == movements
    assert found.scenario is scenario
    assert re.fullmatch("[0-9a-f]{64}", found.network_hash)
    assert inspection.inspect(parsed({"signal": DROP})).saturation == {}


def test_a_signal_that_endangers_is_an_error() -> None:
    with pytest.raises(ScenarioError, match=r"signal\.phases\[1\]: E-C and N-C conflict"):
        findings({"signal.phases.1.movements": ["N-C", "S-C", "E-C"]})

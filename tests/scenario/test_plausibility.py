"""Slips that validate are said in words that name the key."""

from typing import Any

import pytest
from factories.scenarios import SHIPPED, edited, parsed, shipped

from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.plausibility import doubts

PERIOD = edited()["demand"][0]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_are_not_doubted(name: str) -> None:
    assert list(doubts(shipped(name))) == []


def test_a_sound_scenario_is_not_doubted() -> None:
    assert list(doubts(parsed())) == []


@pytest.mark.parametrize(
    ("changes", "doubt"),
    [
        (
            {"approaches.eastbound.speed_limit": 45},
            "approaches.eastbound.speed_limit: 45 m/s are 162 km/h; if 45 are miles an hour, "
            "write 20.12",
        ),
        (
            {"approaches.eastbound.speed_limit": 1.9},
            "approaches.eastbound.speed_limit: 1.9 m/s is slower than a walk",
        ),
        (
            {"approaches.eastbound.length": 0.5},
            "approaches.eastbound.length: 0.5 m hold no queue; give the road from the last "
            "intersection, or at least control_zone (100 m)",
        ),
        (
            {"approaches.eastbound.lanes": " ".join(["R", *["C"] * 40, "L"])},
            "approaches.eastbound.lanes: 42 lanes at the entrance; hardly a road has more than 8",
        ),
        (
            {
                "signal.phases.1": {
                    "movements": ["N-C", "S-C", "N-L"],
                    "permitted": ["S-C"],
                    "green": 9,
                }
            },
            "signal.phases[1].permitted: S-C goes straight on; drivers who do so expect nobody to "
            "cross; name the left that yields",
        ),
        (
            {"demand": [{**PERIOD, "end": 20}, {**PERIOD, "begin": 35}]},
            "demand: nobody comes between 20 s and 35 s",
        ),
        ({"demand.0.begin": 10}, "demand begins at 10 s; until then nobody comes"),
        ({"demand.0.end": 50}, "demand ends at 50 s, before duration (60 s)"),
        (
            {"demand.0.end": 20, "evaluation.warm_up": 30},
            "demand ends at 20 s, before figures count (warm_up, 30 s); let it last as long as "
            "duration",
        ),
        (
            {"evaluation.penetration_rates": [0.5, 0.4, 0.5]},
            "evaluation.penetration_rates: 0.5 stand there more than once",
        ),
        (
            {"evaluation.penetration_rates": [index / 200 for index in range(200)]},
            "evaluation.penetration_rates: 200 rates, so a run is 200 times 10 episodes of each "
            "controller",
        ),
    ],
)
def test_a_slip_is_said(changes: dict[str, Any], doubt: str) -> None:
    assert list(doubts(parsed(changes))) == [doubt]


def test_an_episode_that_ends_before_anybody_arrives_is_said() -> None:
    short = list(doubts(parsed({"evaluation.duration": 5})))
    assert len(short) == 4
    assert short[0] == (
        "evaluation.duration: a vehicle needs 10 s to the entrance of approaches.northbound, so "
        "nobody passes within 5 s"
    )
    slow = list(doubts(parsed({"intersection.speed_cap": 0.001})))
    assert slow[0] == "intersection.speed_cap: 0.001 m/s is slower than a walk"
    assert "a vehicle needs 100000 s to the entrance" in slow[1]


@pytest.mark.parametrize("step", [0.0001, 0.0015, 0.3333333, 1e-9])
def test_a_step_that_sumos_clock_cannot_count_is_refused(step: float) -> None:
    with pytest.raises(ScenarioError, match=r"evaluation\.step: .*whole milliseconds, as in 0\.1"):
        parsed({"evaluation.step": step})


@pytest.mark.parametrize("step", [0.001, 0.1, 0.3, 0.333, 1.0])
def test_whole_milliseconds_are_steps(step: float) -> None:
    assert parsed({"evaluation.step": step}).evaluation.step == step


def test_a_study_has_a_bounded_number_of_seeds() -> None:
    with pytest.raises(ScenarioError, match=r"evaluation\.seeds: .*10000"):
        parsed({"evaluation.seeds": 1_000_000_000})

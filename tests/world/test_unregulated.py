"""Episodes that end before doing nothing shows what comes of it."""

from typing import Any

import pytest
from factories.scenarios import parsed

from benchmark.scenario.layout import COMPASS
from benchmark.scenario.scenario import Scenario
from benchmark.world import unregulated

ROAD = {"length": 200, "bay": 80, "speed_limit": 13.89}
MINOR = {**ROAD, "lanes": "R C L", "upstream_lanes": 1}
MAIN = {**ROAD, "lanes": "RC C L", "upstream_lanes": 2}


def crossing(*, more: float = 1.0, duration: float) -> Scenario:
    """Two roads with 2140 veh/h, on which an hour of dark lights jams and ten minutes do not."""
    few, many = {"left": 80, "cross": 250, "right": 60}, {"left": 100, "cross": 500, "right": 80}
    changes: dict[str, Any] = {"evaluation.duration": duration, "demand.0.end": duration}
    for index, name in enumerate(COMPASS):
        changes[f"approaches.{name}"] = {"heading": 90 * index, **(MAIN if index % 2 else MINOR)}
        changes[f"demand.0.{name}"] = many if index % 2 else few
    return parsed(changes).with_demand(more)


def test_an_episode_that_ends_before_the_jam_is_too_short_and_says_when_it_comes() -> None:
    said = unregulated.too_short(crossing(duration=600))
    assert said is not None
    assert said.startswith("evaluation.duration: 600 s are too short to show what comes of doing")
    jam = unregulated.time_to_jam(crossing(duration=600))
    assert jam is not None
    assert 600 < jam < 3600
    assert f"jams after {jam:.0f} s (seed 1)" in said


@pytest.mark.parametrize(
    "scenario",
    [crossing(more=1.2, duration=900), crossing(more=0.3, duration=600), crossing(duration=3600)],
    ids=["jams in time", "never jams", "an hour"],
)
def test_an_episode_is_long_enough_where_it_shows_the_jam_or_there_is_none(
    scenario: Scenario,
) -> None:
    assert unregulated.too_short(scenario) is None

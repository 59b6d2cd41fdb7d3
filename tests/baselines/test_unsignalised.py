"""Doing nothing wins nowhere among the scenarios that ship to be tried."""

from importlib import resources
from pathlib import Path

import pytest
from factories.scenarios import SMOKE, shipped

from benchmark.scenario.scenario import Scenario, load_scenario
from benchmark.study.episode import Episode, run_episode

TEMPLATE = Path(str(resources.files("benchmark.commands"))) / "templates" / "my-scenario.toml"


def waiting(scenario: Scenario, controller: str, rate: float | None = None) -> float:
    """The mean of the average waiting time over two seeds [s]."""
    waits = []
    for seed in (1, 2):
        (figures,) = run_episode(Episode(scenario, controller, rate, seed)).junctions.values()
        assert figures.average_waiting_time is not None
        waits.append(figures.average_waiting_time)
    return sum(waits) / len(waits)


@pytest.mark.parametrize(
    "scenario", [*map(shipped, SMOKE), load_scenario(TEMPLATE)], ids=lambda scenario: scenario.name
)
def test_somebody_waits_less_than_where_nobody_regulates(scenario: Scenario) -> None:
    rivals = [waiting(scenario, "stop-controlled")]
    rivals += [
        waiting(scenario, "first-come", rate) for rate in scenario.evaluation.penetration_rates
    ]
    assert min(rivals) < waiting(scenario, "unsignalised")

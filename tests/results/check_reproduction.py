"""Committed records come out of the code again as they were."""

import pytest

from benchmark.records import reference
from benchmark.records.record import Record
from benchmark.scenario import catalogue
from benchmark.study import episode
from benchmark.study.episode import Episode
from benchmark.study.rescoring import contradictions


@pytest.mark.parametrize(
    ("scenario", "controller", "rate"),
    [
        ("334", "traffic-light-actuated", None),
        ("229", "virtual-signal", 0.6),
        ("332", "wang", 0.8),
        ("334", "wang-tuned", 0.7),
        ("229", "time-windows", 0.6),
        ("334", "hierarchical", 0.5),
        ("449", "hierarchical-tuned", 0.7),
    ],
)
def test_a_record_comes_out_again_as_it_was_committed(
    records: list[Record], scenario: str, controller: str, rate: float | None
) -> None:
    committed = next(
        r
        for r in records
        if r.scenario.endswith(scenario) and (r.controller, r.rate, r.seed) == (controller, rate, 3)
    )
    again = episode.run_episode(
        episode.Episode(catalogue.find_scenarios([scenario])[0], controller, rate, 3)
    )
    varies = {"wall_time", "versions", "controller_from", "identity", "trained_on"}  # younger: two
    assert contradictions(committed, again, varies) == []


@pytest.mark.parametrize(
    ("scenario", "controller", "rate"),
    [
        ("smoke/tee", "traffic-light", None),
        ("smoke/asymmetric", "first-come", 0.5),
        ("smoke/crossing", "virtual-signal", 1.0),
        ("smoke/crossing", "time-windows", 0.5),
        ("smoke/asymmetric", "wang", 0.5),
    ],
)
def test_ours_equals_what_the_code_gives(
    shipped: reference.RegressionReference, scenario: str, controller: str, rate: float | None
) -> None:
    (committed,) = (
        one
        for one in shipped.records
        if (one.scenario, one.controller, one.rate, one.seed) == (scenario, controller, rate, 2)
    )
    again = episode.run_episode(
        Episode(catalogue.find_scenario(scenario), controller, rate, seed=2)
    )
    varies = {"wall_time", "versions", "controller_from", "identity"}  # the last is of the code
    assert contradictions(committed, again, varies) == [], "regenerate with `make reference`"

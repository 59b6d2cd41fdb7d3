"""What episodes are expected to take, and so which start first."""

import dataclasses

import pytest
from factories.scenarios import smoke
from hypothesis import given
from hypothesis import strategies as st

from benchmark.records import table
from benchmark.records.record import Record
from benchmark.study.cost import estimates, slowest_first
from benchmark.study.episode import Episode

ONE = Episode(smoke("tee"), "virtual-signal", 0.5, 1)


def took(seconds: float, episode: Episode = ONE) -> Record:
    return episode.record("ok").model_copy(update={"wall_time": seconds})


def test_more_demand_more_time_fewer_robots_and_dark_lights_take_longer() -> None:
    scenario = smoke("tee")
    duration = {"duration": scenario.evaluation.duration / 2}
    shorter = scenario.with_evaluation(scenario.evaluation.model_copy(update=duration))
    first, second = (period.total for period in scenario.demand)
    (usual,) = estimates([ONE])
    for change, factor in (
        ({"scenario": scenario.with_demand(2.0)}, 2.0),
        ({"scenario": shorter}, first / (first + second)),
    ):
        (found,) = estimates([dataclasses.replace(ONE, **change)])
        assert found / usual == pytest.approx(factor)
    slower = [dataclasses.replace(ONE, rate=0.1), dataclasses.replace(ONE, controller="first-come")]
    assert [found > usual for found in estimates(slower)] == [True, False]
    none = Episode(scenario, "unsignalised", None, 1)
    signals = Episode(scenario, "traffic-light", None, 1)
    assert estimates([none])[0] > usual > estimates([signals])[0] > 0


def test_earlier_records_of_the_same_rate_count_more_than_those_of_others() -> None:
    records = [
        took(4.0, dataclasses.replace(ONE, seed=7)),
        took(2.0, dataclasses.replace(ONE, seed=8)),
        took(99.0, dataclasses.replace(ONE, rate=0.9)),
        took(0.0, dataclasses.replace(ONE, seed=9)),  # it did not get far
        took(50.0, dataclasses.replace(ONE, controller="first-come")),
    ]
    others = [ONE, dataclasses.replace(ONE, rate=0.2), dataclasses.replace(ONE, rate=0.9)]
    assert estimates(others, table.records_table(records)) == [3.0, 35.0, 99.0]


@given(st.lists(st.sampled_from([0.5, 1.0, 2.0]), max_size=8))
def test_the_slowest_start_first_and_equals_as_given(times: list[float]) -> None:
    chosen = [dataclasses.replace(ONE, seed=seed) for seed in range(len(times))]
    found = slowest_first(chosen, times)
    assert [(-times[one.seed], one.seed) for one in found] == sorted(
        (-time, seed) for seed, time in enumerate(times)
    )

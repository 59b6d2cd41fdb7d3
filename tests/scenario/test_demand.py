"""Counts over several periods."""

import pytest

from benchmark.scenario.demand import Demand, TurnCounts, busiest


def period(begin: float, end: float, cross: float) -> Demand:
    return Demand(begin=begin, end=end, northbound=TurnCounts(cross=cross))


def crossing(*periods: Demand) -> tuple[float, float, float]:
    found = busiest(periods)
    return found.begin, found.end, found.counts("northbound").cross


def test_a_period_of_15_minutes_or_of_all_there_is_stands_as_it_is() -> None:
    assert crossing(period(0, 900, 700)) == (0, 900, 700)
    assert crossing(period(100, 160, 700)) == (100, 160, 700)
    assert crossing(period(0, 3600, 700)) == (0, 900, 700)


def test_a_platoon_weighs_as_much_as_it_lasts() -> None:
    assert crossing(period(0, 60, 3000), period(60, 120, 1000)) == (0, 120, 2000)
    begin, end, cross = crossing(period(0, 1800, 300), period(1800, 1860, 3000))
    assert (begin, end, cross) == (960, 1860, pytest.approx(300 + 60 / 900 * 2700))


def test_the_busiest_15_minutes_may_lie_anywhere() -> None:
    quiet, busy = period(0, 1000, 100), period(1000, 1500, 900)
    assert crossing(quiet, busy, period(1500, 3000, 200)) == (
        1000,
        1900,
        (500 * 900 + 400 * 200) / 900,
    )
    assert crossing(quiet, busy, period(2000, 3000, 800)) == (2000, 2900, 800)

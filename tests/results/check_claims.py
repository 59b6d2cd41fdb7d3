"""What README and docs say of the committed results is true of them."""

import heapq
import math
from statistics import mean, stdev

import pytest
from factories.committed import FOUR, RATES, Figure, by_seed, differences, waiting
from factories.scenarios import ROOT

from baselines.paper import published
from baselines.paper.reductions import against, summary
from baselines.paper.samples import Samples
from benchmark.records import leaderboard
from benchmark.records.record import Record
from benchmark.records.statistics import estimates
from benchmark.scenario import catalogue
from benchmark.study import cost, episode


def waits(rows: list[leaderboard.Row], scenario: str, controller: str) -> list[float]:
    """Average waiting time by rising penetration rate."""
    chosen = [r for r in rows if r.scenario.endswith(scenario) and r.controller == controller]
    chosen.sort(key=lambda row: row.rate or 0.0)
    assert [row.rate for row in chosen] == RATES
    return [row.figures["average_waiting_time"].mean for row in chosen]


@pytest.mark.parametrize("workers", [2, 4, 16])
def test_few_cores_idle_at_the_end_of_a_suite_that_never_ran_before(
    records: list[Record], workers: int
) -> None:
    """Episodes in the order that guesses give, for as long as they really took."""
    chosen = [one for one in records if one.rate in (None, 0.4, 0.5, 0.6, 0.7) and one.seed <= 2]
    found = {one.name: one for one in catalogue.find_scenarios(["colorado-springs"])}
    took = {one.episode: one.wall_time for one in chosen}
    suite = [
        episode.Episode(found[one.scenario], one.controller, one.rate, one.seed) for one in chosen
    ]
    busy = [0.0] * workers
    for one in cost.slowest_first(suite, cost.estimates(suite)):
        heapq.heapreplace(busy, busy[0] + took[one.key])
    assert sum(max(busy) - each for each in busy) < 0.1 * workers * max(busy)


def test_the_deployed_signals_wait_as_the_paper_says(rows: list[leaderboard.Row]) -> None:
    for scenario in ("229", "332", "334"):
        assert 12 <= waits(rows, scenario, "traffic-light")[0] <= 30
    assert waits(rows, "449", "traffic-light")[0] == pytest.approx(45, rel=0.1)


@pytest.mark.parametrize("scenario", FOUR)
def test_the_virtual_signal_waits_less_with_more_rvs(
    rows: list[leaderboard.Row], scenario: str
) -> None:
    by_rate = waits(rows, scenario, "virtual-signal")
    thirds = [mean(by_rate[:3]), mean(by_rate[3:6]), mean(by_rate[6:])]
    assert thirds == sorted(thirds, reverse=True)
    assert by_rate[-1] < min(by_rate[:6])


@pytest.mark.parametrize("scenario", FOUR)
@pytest.mark.parametrize("controller", ["wang", "wang-tuned"])
def test_the_learned_controllers_wait_less_with_more_rvs(
    rows: list[leaderboard.Row], scenario: str, controller: str
) -> None:
    by_rate = waits(rows, scenario, controller)
    thirds = [mean(by_rate[:3]), mean(by_rate[3:6]), mean(by_rate[6:])]
    assert thirds == sorted(thirds, reverse=True)


@pytest.mark.parametrize("rate", [0.7, 0.8, 0.9, 1.0])
def test_from_70_percent_on_wang_waits_less_than_the_deployed_signal_on_three_of_four(
    rows: list[leaderboard.Row], rate: float
) -> None:
    below = [
        row.scenario
        for row in rows
        if (row.controller, row.rate) == ("wang", rate)
        and row.difference is not None
        and row.difference.mean < 0
    ]
    assert len(below) >= 3


def travel(record: Record) -> float | None:
    return record.trips.travel_time if record.trips else None


def test_wang_tuned_is_nowhere_significantly_worse_than_first_come(records: list[Record]) -> None:
    pairs = {
        (scenario, rate): differences(
            by_seed(records, scenario, "wang-tuned", rate),
            by_seed(records, scenario, "first-come", rate),
            waiting,
        )
        for scenario in FOUR
        for rate in RATES
    }
    found = dict(zip(pairs, estimates(list(pairs.values())), strict=True))
    assert not [key for key, one in found.items() if one.excludes_zero and one.mean > 0]


@pytest.mark.parametrize("figure", [waiting, travel])
@pytest.mark.parametrize("scenario", FOUR)
def test_time_windows_beat_the_better_signal_from_50_percent_on(
    records: list[Record], scenario: str, figure: Figure
) -> None:
    signals = [
        by_seed(records, scenario, name, None)
        for name in ("traffic-light-webster", "traffic-light-actuated")
    ]
    better = min(signals, key=lambda of: mean(figure(one) or math.inf for one in of.values()))
    ours = [by_seed(records, scenario, "time-windows", rate) for rate in RATES[4:]]
    half, *more = estimates([differences(of, better, figure) for of in ours])
    assert half.mean <= 0 or not half.excludes_zero
    assert all(one.mean < 0 and one.excludes_zero for one in more)


def test_time_windows_collide_at_most_a_tenth_as_often_as_first_come(records: list[Record]) -> None:
    collisions = {
        name: sum(
            r.trips.collisions_with_robot for r in records if r.controller == name and r.trips
        )
        for name in ("time-windows", "first-come")
    }
    assert 10 * collisions["time-windows"] <= collisions["first-come"]


TUNED = "hierarchical-tuned"


@pytest.mark.parametrize(
    ("baseline", "least", "words"),
    [("wang", 0.23, "80.0 %, 16 cells"), ("traffic-light", 0.36, "79.5 %, 16 cells")],
)
def test_the_tuned_hierarchy_waits_less_in_every_cell(
    samples: Samples, baseline: str, least: float, words: str
) -> None:
    found = summary(against(samples, baseline), TUNED)
    assert found.surely_lower == found.cells == 16
    assert found.mean is not None
    assert found.mean >= least
    assert words.startswith(f"{100 * found.mean:.1f} %")
    assert words in (ROOT / "docs" / "reproduction.md").read_text("utf-8")


@pytest.mark.parametrize("training", ["", "?training=1", "?training=2"])
def test_the_tuned_low_level_beats_a_random_one_in_nearly_every_cell(
    samples: Samples, training: str
) -> None:
    pair = (TUNED + training, f"{TUNED}?low=random")
    sure = 0
    for cell in published.cells():
        waits = samples.paired("average_waiting_time", pair, cell)
        assert waits is not None
        (difference,) = estimates([(waits[0] - waits[1]).tolist()])
        sure += difference.excludes_zero and difference.mean < 0
    assert sure >= 15


def test_the_tuned_hierarchy_varies_less_than_wang_and_travels_faster(samples: Samples) -> None:
    for cell in published.cells():
        ours, wang = (samples.values("average_waiting_time", n, cell) for n in (TUNED, "wang"))
        assert stdev(ours.values()) <= stdev(wang.values())
        ours, wang = (samples.values("travel_time", n, cell) for n in (TUNED, "wang"))
        assert mean(ours.values()) < mean(wang.values())


@pytest.mark.parametrize("rate", RATES)
def test_no_rv_of_the_tuned_hierarchy_collides_more_than_wangs(
    records: list[Record], rate: float
) -> None:
    counts = {
        name: sum(
            r.trips.collisions_with_robot
            for r in records
            if (r.controller, r.rate) == (name, rate) and r.trips
        )
        for name in (TUNED, "wang")
    }
    assert counts[TUNED] <= counts["wang"]


@pytest.mark.parametrize("scenario", FOUR)
def test_nobody_regulating_jams(rows: list[leaderboard.Row], scenario: str) -> None:
    signal, nobody = (waits(rows, scenario, c)[0] for c in ("traffic-light", "unsignalised"))
    assert nobody > 4 * signal

"""From records to rows: means, differences to the signal, marks, and nobody left out."""

import math
from collections.abc import Iterable
from typing import Any

import pytest
from factories.records import SIGNAL, junction, record, unlucky
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmark.records import leaderboard
from benchmark.records.leaderboard import Row
from benchmark.records.measures import MEASURES
from benchmark.records.record import (
    Record,
    Training,
    Waiting,
)
from benchmark.records.statistics import estimates


def only(found: Iterable[Row]) -> Row:
    (row,) = found
    return row


def pair(controller: str, north: float, south: float, rate: float | None, **facts: Any) -> Record:
    """An episode of two junctions."""
    both = {"N": junction(north), "S": junction(south)}
    return record(controller, junctions=both, rate=rate, **facts)


def keys(found: Iterable[Row]) -> list[tuple[str, float | None, str]]:
    return [(row.scenario, row.rate, row.controller) for row in found]


def test_every_figure_is_the_mean_of_its_field() -> None:
    nested = {"mean": "waiting_time_per_vehicle", "p95": "waiting_time_p95"}
    nested |= {"maximum": "waiting_time_maximum", "vehicles": "vehicles"}
    keys = [measure.key for measure in MEASURES]
    facts: dict[str, Any] = {key: 1 + i for i, key in enumerate(keys) if key not in nested.values()}
    per_vehicle = Waiting(mean=31, p95=32, maximum=33, vehicles=34)
    expected = facts | {key: getattr(per_vehicle, field) for field, key in nested.items()}
    waiting = facts.pop("average_waiting_time")
    one = record(waiting=waiting, waiting_time_per_vehicle=per_vehicle, **facts)
    row = only(leaderboard.rows_of_records([one]))
    assert {key: figure.mean for key, figure in row.figures.items()} == expected
    assert expected.keys() == set(keys)


def test_a_figure_counts_the_seeds_that_have_it() -> None:
    row = only(
        leaderboard.rows_of_records(
            [record(seed=1, time_loss=10.0), record(seed=2, time_loss=None), unlucky(seed=3)]
        )
    )
    assert (row.figures["time_loss"].mean, row.figures["time_loss"].count) == (10.0, 1)
    assert (row.figures["throughput"].count, row.other) == (2, {"failed": 1})
    assert "co2" not in row.figures
    assert row.headline == row.figures["average_waiting_time"]


def test_a_figure_has_the_interval_of_its_values() -> None:
    waits = [20.0, 30.0, 25.0, 27.0, 22.0, 29.5]
    row = only(
        leaderboard.rows_of_records([record(seed=s, waiting=w) for s, w in enumerate(waits)])
    )
    assert [row.headline] == estimates([waits])


def test_no_records_make_no_rows() -> None:
    assert leaderboard.rows_of_records([]) == []


def test_the_newest_record_of_an_episode_counts() -> None:
    old, new = record(seed=1, waiting=99.0), record(seed=1, waiting=10.0)
    row = only(
        leaderboard.rows_of_records([unlucky(seed=1), old, record(seed=2, waiting=20.0), new])
    )
    assert row.headline is not None
    assert (row.headline.mean, row.headline.count, row.other) == (15.0, 2, {})
    row = only(leaderboard.rows_of_records([new, unlucky(seed=1, status="crashed")]))
    assert (row.headline, row.other) == (None, {"crashed": 1})


def test_a_controller_without_a_rate_stands_at_every_rate_of_its_scenario() -> None:
    found = leaderboard.rows_of_records(
        [
            *(record(SIGNAL, rate=None, seed=seed, waiting=9.0) for seed in (1, 2)),
            *(record("c", rate=rate, waiting=30.0) for rate in (0.7, 0.1)),
            record("alone", rate=None, scenario="test/b"),
        ]
    )
    assert keys(found) == [
        *(("test/a", 0.1, SIGNAL), ("test/a", 0.1, "c")),
        *(("test/a", 0.7, SIGNAL), ("test/a", 0.7, "c")),
        ("test/b", None, "alone"),
    ]
    assert found[0].figures == found[2].figures
    assert [row.difference and row.difference.mean for row in found[:4]] == [None, 21.0, None, 21.0]


def test_rows_go_by_scenario_and_rate_with_the_least_waiting_first() -> None:
    found = leaderboard.rows_of_records(
        [
            unlucky("broken"),
            record("slow", waiting=30.0),
            record("quick", waiting=5.0),
            record("a tie", waiting=5.0),
            record("quick", scenario="test/0", waiting=50.0),
            record("slow", rate=0.1, waiting=90.0),
        ]
    )
    assert keys(found) == [
        *(("test/0", 0.5, "quick"), ("test/a", 0.1, "slow"), ("test/a", 0.5, "a tie")),
        *(("test/a", 0.5, "quick"), ("test/a", 0.5, "slow"), ("test/a", 0.5, "broken")),
    ]


@pytest.mark.parametrize("status", ["failed", "crashed", "timed out", "skipped"])
def test_episodes_that_are_not_ok_are_counted_and_keep_their_row(status: str) -> None:
    bad = [unlucky(seed=seed, status=status) for seed in (1, 2)]
    good = [record(seed=seed, waiting=10.0) for seed in (3, 4, 5)]
    row = only(leaderboard.rows_of_records(bad))
    assert (row.headline, row.figures, row.other) == (None, {}, {status: 2})
    row = only(leaderboard.rows_of_records([*bad, *good]))
    assert row.headline is not None
    assert (row.headline.count, row.other) == (3, {status: 2})


def test_each_way_to_fail_is_counted_apart() -> None:
    ways = ["failed", "crashed", "failed", "timed out", "skipped"]
    records = [unlucky(seed=seed, status=status) for seed, status in enumerate(ways)]
    row = only(leaderboard.rows_of_records(records))
    assert row.other == {"failed": 2, "crashed": 1, "timed out": 1, "skipped": 1}


@pytest.mark.parametrize(
    ("records", "rules"),
    [
        ([record(rate=None)], "lights"),
        ([record()], "flexible"),
        ([record(arbitration="own")], "own"),
        ([unlucky(arbitration="own")], "own"),
        ([unlucky(status="crashed")], "?"),
        ([record(seed=1), unlucky(seed=2, status="crashed")], "flexible"),
        ([unlucky(seed=1, status="timed out"), record(seed=2)], "flexible"),
        ([record(seed=1, rate=None), unlucky(seed=2, rate=None, status="crashed")], "lights"),
    ],
)
def test_a_row_says_what_rules_as_far_as_any_record_knows(
    records: list[Record], rules: str
) -> None:
    assert only(leaderboard.rows_of_records(records)).rules == rules


def test_two_scenarios_of_one_name_do_not_mix() -> None:
    old, new = "0" * 64, "1" * 64
    found = leaderboard.rows_of_records(
        [
            record(SIGNAL, rate=None, waiting=50.0, scenario_hash=old),
            record(rate=0.1, waiting=40.0, scenario_hash=old),
            record(waiting=30.0, scenario_hash=new),
            record(seed=2, waiting=10.0, scenario_hash=new),
            record(scenario="test/b"),
        ]
    )
    assert [(row.scenario, row.scenario_hash, row.rate, row.controller) for row in found] == [
        ("test/a (00000000)", old, 0.1, "c"),
        ("test/a (00000000)", old, 0.1, SIGNAL),
        ("test/a (11111111)", new, 0.5, "c"),
        ("test/b", record(scenario="test/b").scenario_hash, 0.5, "c"),
    ]
    first, _, second, _ = found
    assert (first.difference and first.difference.mean, second.difference) == (-10.0, None)
    assert second.headline is not None
    assert (second.headline.mean, second.headline.count) == (20.0, 2)


def of_file(content: str, seed: int, waiting: float) -> Record:
    facts = {"controller": "mine.py:Mine", "controller_from": f"mine.py sha256:{content * 64}"}
    return record(seed=seed, waiting=waiting, **facts)


def test_files_of_one_name_do_not_mix_and_need_no_hash_while_there_is_one() -> None:
    first = [of_file("a", seed, 10.0) for seed in (1, 2)]
    second = [of_file("b", 1, 30.0), of_file("b", 3, 40.0)]
    assert only(leaderboard.rows_of_records(first)).controller == "mine.py:Mine"
    late = unlucky("mine.py:Mine", 2, "timed out", controller_from=second[0].controller_from)
    found = {row.controller: row for row in leaderboard.rows_of_records([*first, *second, late])}
    assert {name: row.headline and row.headline.mean for name, row in found.items()} == {
        "mine.py:Mine (aaaaaaaa)": 10.0,
        "mine.py:Mine (bbbbbbbb)": 35.0,
    }
    assert found["mine.py:Mine (bbbbbbbb)"].other == {"timed out": 1}


def test_versions_of_a_distribution_are_one_controller() -> None:
    found = [record(seed=seed, controller_from=f"pack {seed}.0") for seed in (1, 2)]
    assert only(leaderboard.rows_of_records(found)).controller == "c"


def test_several_junctions_of_a_record_are_several_rows() -> None:
    found = leaderboard.rows_of_records(
        [pair("c", 10.0, 40.0, 0.5), pair(SIGNAL, 20.0, 30.0, None)]
    )
    assert keys(found) == [
        *(("test/a N", 0.5, "c"), ("test/a N", 0.5, SIGNAL)),
        *(("test/a S", 0.5, SIGNAL), ("test/a S", 0.5, "c")),
        *(("test/a network", 0.5, "c"), ("test/a network", 0.5, SIGNAL)),
    ]
    waits = [row.headline and row.headline.mean for row in found]
    assert waits == [10.0, 20.0, 30.0, 40.0, None, None]
    differences = [row.difference and row.difference.mean for row in found]
    assert differences == [-10.0, None, None, 10.0, None, None]
    assert [row.is_of_network for row in found] == [False] * 4 + [True] * 2


def test_figures_of_whole_trips_stand_once_in_the_row_of_the_network() -> None:
    *junctions, network = leaderboard.rows_of_records([pair("c", 10.0, 40.0, 0.5)])
    of_trips = {measure.key for measure in MEASURES if measure.is_of_trips}
    assert network.figures["time_loss"].mean == 30.0
    assert network.figures.keys() <= of_trips
    assert all(not of_trips & row.figures.keys() for row in junctions)


def test_a_junction_is_flagged_for_what_happens_in_its_network() -> None:
    found = leaderboard.rows_of_records(
        [pair("c", 10.0, 40.0, 0.5, collisions=1), pair(SIGNAL, 20.0, 30.0, None)]
    )
    assert {row.scenario: row.marks for row in found if row.controller == "c"} == {
        "test/a N": ("crashes",),
        "test/a S": (),  # where vehicles wait longer than under the signal
        "test/a network": (),
    }


def test_a_controller_that_always_fails_stands_at_each_junction() -> None:
    both = {"N": junction(10.0), "S": junction(40.0)}
    found = leaderboard.rows_of_records([record(junctions=both), unlucky("broken")])
    assert keys(found) == [
        *(("test/a N", 0.5, "c"), ("test/a N", 0.5, "broken")),
        *(("test/a S", 0.5, "c"), ("test/a S", 0.5, "broken")),
        *(("test/a network", 0.5, "broken"), ("test/a network", 0.5, "c")),
    ]
    assert [row.other for row in found[:4]] == [{}, {"failed": 1}] * 2


@pytest.mark.parametrize(
    ("records", "status", "reasons"),
    [
        ([record()], "ok", ()),
        ([unlucky(status="skipped", reason="a tee")], "skipped", ("1 skipped (a tee)",)),
        (
            [
                unlucky(seed=1, reason="rare"),
                unlucky(seed=2, reason="act\n  raised"),
                unlucky(seed=3, reason="act\n  raised"),
            ],
            "failed",
            ("3 failed (act raised)",),
        ),
        (
            [unlucky(seed=1, status="skipped", reason="a tee"), unlucky(seed=2, status="crashed")],
            "failed",
            ("1 skipped (a tee)", "1 crashed (no reason given)"),
        ),
        (
            [record(seed=1), unlucky(seed=2, status="timed out", reason="600 s")],
            "flagged",
            ("1 timed out (600 s)",),
        ),
    ],
)
def test_a_row_says_what_became_of_its_episodes(
    records: list[Record], status: str, reasons: tuple[str, ...]
) -> None:
    row = only(leaderboard.rows_of_records(records))
    assert (row.status, row.reasons) == (status, reasons)


def test_a_marked_row_is_flagged_with_its_marks() -> None:
    signal = record(SIGNAL, rate=None, waiting=20.0)
    found = leaderboard.rows_of_records([signal, record("c", waiting=10.0, collisions=1)])
    assert {row.controller: (row.status, row.reasons) for row in found} == {
        SIGNAL: ("ok", ()),
        "c": ("flagged", ("crashes", "1.0 collisions an episode")),
    }


def training(first: int, last: int, *scenarios: str) -> tuple[Training, ...]:
    return (Training(scenarios=scenarios or ("test/a",), first=first, last=last),)


def test_a_row_trained_on_seeds_of_its_evaluation_is_flagged() -> None:
    met = [record(seed=seed, trained_on=training(3, 9)) for seed in range(1, 6)]
    row = only(leaderboard.rows_of_records(met))
    assert (row.status, row.reasons) == (
        "flagged",
        ("trained on 3 seeds from 3 to 5 of its evaluation",),
    )
    row = only(leaderboard.rows_of_records([record(seed=7, trained_on=training(7, 7))]))
    assert row.reasons == ("trained on seed 7 of its evaluation",)
    apart = [record(seed=seed, trained_on=training(10_000, 10_199)) for seed in range(1, 6)]
    assert only(leaderboard.rows_of_records(apart)).status == "ok"


@pytest.mark.parametrize(
    ("scenario", "declared", "meets"),
    [
        ("test/a", "test/a", True),
        ("test/a", "a", True),
        ("test/a", "test", True),
        ("test/a@700", "a", True),
        ("test/a", "test/a@700", True),
        ("test/a", "elsewhere/test/a.toml", True),
        ("test/a", "elsewhere\\test", True),
        ("test/a", "other/a", False),
        ("test/a", "other/test/b.toml", False),
        ("test/a", "b", False),
    ],
)
def test_training_meets_scenarios_however_they_were_named(
    scenario: str, declared: str, meets: bool
) -> None:
    (one,) = training(1, 2, declared)
    assert [one.meets(scenario, seed) for seed in (0, 1, 2, 3)] == [False, meets, meets, False]


def test_a_difference_is_paired_over_the_seeds_that_both_have() -> None:
    signal, own = {1: 20.0, 2: 50.0, 3: 30.0, 4: 99.0}, {3: 24.0, 2: 45.0, 1: 19.0, 7: 1.0}
    found = leaderboard.rows_of_records(
        [
            *(record(SIGNAL, seed, waiting, rate=None) for seed, waiting in signal.items()),
            *(record("c", seed, waiting) for seed, waiting in own.items()),
            unlucky("c", 4),
        ]
    )
    difference = {row.controller: row.difference for row in found}
    assert difference == {SIGNAL: None, "c": estimates([[-1.0, -5.0, -6.0]])[0]}
    assert difference["c"] is not None
    assert (difference["c"].mean, difference["c"].count) == (-4.0, 3)


@pytest.mark.parametrize(
    "signals",
    [
        [],
        [record("traffic-light-actuated", rate=None)],
        [record(SIGNAL, seed=2, rate=None)],
        [unlucky(SIGNAL, rate=None)],
        [record(SIGNAL, rate=None, scenario="test/b")],
        [record(SIGNAL, rate=None, scenario_hash="b" * 64)],
        [record(SIGNAL, rate=0.6)],
        [record(SIGNAL, rate=None, waiting=None)],
    ],
)
def test_without_a_signal_on_the_same_seed_there_is_no_difference(signals: list[Record]) -> None:
    found = leaderboard.rows_of_records([record(seed=1), *signals])
    row = only(row for row in found if row.controller == "c" and row.scenario_hash[0] == "a")
    assert row.difference is None


WAITS = st.dictionaries(st.integers(1, 9), st.one_of(st.none(), st.floats(0, 99)))


@settings(max_examples=30)
@given(own=WAITS, signal=WAITS)
def test_rows_agree_with_counting_seed_by_seed(
    own: dict[int, float | None], signal: dict[int, float | None]
) -> None:
    """None stands for an episode that failed."""

    def made(controller: str, waits: dict[int, float | None], rate: float | None) -> list[Record]:
        return [
            unlucky(controller, s, rate=rate) if w is None else record(controller, s, w, rate)
            for s, w in waits.items()
        ]

    found = {
        row.controller: row
        for row in leaderboard.rows_of_records([*made("c", own, 0.5), *made(SIGNAL, signal, None)])
    }
    assert found.keys() == {name for name, waits in (("c", own), (SIGNAL, signal)) if waits}
    if own:
        row = found["c"]
        good = [w for w in own.values() if w is not None]
        pairs = [
            w - other
            for s, w in own.items()
            if w is not None and (other := signal.get(s)) is not None
        ]
        assert (row.headline.count if row.headline else 0) == len(good)
        assert row.other.get("failed", 0) == len(own) - len(good)
        assert (row.difference.count if row.difference else 0) == len(pairs)
        if row.headline:
            assert row.headline.mean == pytest.approx(sum(good) / len(good))
        if row.difference:
            assert row.difference.mean == pytest.approx(sum(pairs) / len(pairs), abs=1e-9)


@settings(max_examples=20)
@given(st.permutations(range(8)))
def test_the_order_in_which_episodes_ended_changes_nothing(order: list[int]) -> None:
    """Resampling depends on the order of the values."""
    waits = [3.0, 8.0, 1.0, 44.0, 2.5, 7.0, 9.0, 0.1]
    held = [record(seed=seed, waiting=wait) for seed, wait in enumerate(waits)]
    found = leaderboard.rows_of_records([held[index] for index in order])
    assert found == leaderboard.rows_of_records(held)


def test_a_row_says_how_likely_a_gridlock_within_an_hour_is_and_is_flagged_for_it() -> None:
    locks = [record(seed=seed, gridlock_exposure=1800.0) for seed in range(1, 4)]
    locks.append(record(seed=4, first_gridlock=600.0, gridlock_exposure=600.0))
    row = only(leaderboard.rows_of_records(locks))
    assert row.gridlock is not None
    assert row.gridlock.mean == pytest.approx(1 - math.exp(-3600 / (3 * 1800 + 600)))
    assert row.gridlock.count == 4
    assert (row.status, row.reasons) == (
        "flagged",
        ("gridlocks in 1 of 4 episodes, the earliest at 600 s",),
    )


def test_a_row_without_a_gridlock_is_ok_and_older_records_do_not_say() -> None:
    row = only(leaderboard.rows_of_records([record(gridlock_exposure=900.0)]))
    assert row.gridlock is not None
    assert (row.gridlock.mean, row.status) == (0.0, "ok")
    assert only(leaderboard.rows_of_records([record()])).gridlock is None


def test_the_same_content_in_two_folders_is_one_scenario() -> None:
    same = {"scenario_hash": "b" * 64}
    signal = record(SIGNAL, rate=None, waiting=20.0, scenario="old/a", **same)
    ours = record("c", waiting=10.0, scenario="new/a", **same)
    found = leaderboard.rows_of_records([signal, ours])
    assert {row.scenario for row in found} == {"new/a"}
    (row,) = (row for row in found if row.controller == "c")
    assert row.difference is not None
    assert row.difference.mean == -10.0


def test_a_scenario_at_a_demand_of_its_own_keeps_its_name() -> None:
    scaled = record(scenario="test/a@700", scenario_hash=record().scenario_hash)
    found = leaderboard.rows_of_records([record(), scaled])
    assert {row.scenario for row in found} == {"test/a", "test/a@700"}

"""The verdicts of the regression check: what is worse, what is chance, and what cannot be said."""

import random
from collections.abc import Sequence
from typing import Any

import pytest
from factories.comparisons import BASE, KEYS, LIMIT, THROUGHPUT, WAITING, compared, scaled
from factories.records import junction, record, runs, unlucky
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmark.records.measures import MEASURES, Measure
from benchmark.records.record import Record
from benchmark.records.regression import Finding, RegressionCheck, Verdict, compare, judge
from benchmark.records.statistics import ENOUGH


def only(comparison: RegressionCheck) -> Finding:
    (row,) = comparison.findings
    return row


def verdict(old: Sequence[float], new: Sequence[float], column: Measure = WAITING) -> Verdict:
    return judge(old, new, LIMIT, column).verdict


@pytest.mark.parametrize(
    ("factor", "expected"),
    [
        (1.0, Verdict.UNCHANGED),
        (1.04, Verdict.UNCHANGED),  # certain, but within the limit
        (1.06, Verdict.WORSE),
        (3.0, Verdict.WORSE),
        (0.96, Verdict.UNCHANGED),
        (0.94, Verdict.BETTER),
    ],
)
def test_a_change_at_every_seed_counts_past_the_limit(factor: float, expected: Verdict) -> None:
    assert verdict(BASE, scaled(factor)) == expected


def test_the_limit_is_the_same_both_ways() -> None:
    assert judge(BASE, scaled(1.2), 0.25, WAITING).verdict == Verdict.UNCHANGED
    assert judge(scaled(1.2), BASE, 0.25, WAITING).verdict == Verdict.UNCHANGED
    assert judge(BASE, scaled(1.3), 0.25, WAITING).verdict == Verdict.WORSE
    assert judge(scaled(1.3), BASE, 0.25, WAITING).verdict == Verdict.BETTER


def test_more_throughput_is_better() -> None:
    assert verdict(BASE, scaled(2.0), THROUGHPUT) == Verdict.BETTER
    assert verdict(BASE, scaled(0.5), THROUGHPUT) == Verdict.WORSE


def test_one_seed_far_off_is_not_proven() -> None:
    assert verdict(BASE, [*BASE[:-1], 90.0]) == Verdict.UNPROVEN
    assert verdict([*BASE[:-1], 90.0], BASE) == Verdict.UNPROVEN


@pytest.mark.parametrize("seeds", range(1, len(BASE) + 1))
def test_it_takes_enough_seeds_to_prove_anything(seeds: int) -> None:
    expected = Verdict.WORSE if seeds >= ENOUGH else Verdict.UNPROVEN
    assert verdict(BASE[:seeds], scaled(2.0)[:seeds]) == expected


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (0.0, 0.0, Verdict.UNCHANGED),
        (0.0, 0.05, Verdict.UNCHANGED),  # less than the leaderboard shows
        (0.02, 0.08, Verdict.UNCHANGED),
        (0.0, 0.2, Verdict.WORSE),
        (0.2, 0.0, Verdict.BETTER),
    ],
)
def test_next_to_nothing_has_no_ratio_but_a_floor(
    old: float, new: float, expected: Verdict
) -> None:
    assert verdict([old] * 8, [new] * 8) == expected


def test_the_figures_of_a_row_are_those_of_its_seeds() -> None:
    row = only(compared(runs(BASE), runs(scaled(1.5))))
    assert (row.seeds, row.reference, row.new) == (8, 21.0625, pytest.approx(31.59375))
    assert row.ratio == pytest.approx(1.5)
    assert row.difference is not None
    assert row.difference.mean == pytest.approx(10.53125)
    assert row.difference.excludes_zero
    assert only(compared(runs([0.0]), runs([9.0]))).ratio is None


WAIT = st.floats(0, 1e4)
PAIRS = st.lists(st.tuples(WAIT, WAIT), min_size=1, max_size=12)
LIMITS = st.floats(0, 2)
few = settings(max_examples=25)


@few
@given(pairs=PAIRS, limit=LIMITS, column=st.sampled_from(MEASURES))
def test_worse_needs_a_ratio_past_the_limit_and_an_interval_without_zero(
    pairs: list[tuple[float, float]], limit: float, column: Measure
) -> None:
    old, new = zip(*pairs, strict=True)
    found = judge(old, new, limit, column)
    if found.verdict not in (Verdict.WORSE, Verdict.BETTER):
        return
    smaller, greater = sorted((found.reference, found.new))
    assert greater > smaller * (1 + limit) * (1 - 1e-12)
    assert found.difference.low is not None
    assert found.difference.high is not None
    rises = found.difference.low > 0
    assert rises or found.difference.high < 0
    assert rises == (found.new > found.reference)
    assert (found.verdict is Verdict.BETTER) == (rises == column.more_is_better)
    assert len(pairs) >= ENOUGH


@few
@given(pairs=PAIRS, limit=LIMITS)
def test_what_is_worse_one_way_is_better_the_other_way(
    pairs: list[tuple[float, float]], limit: float
) -> None:
    """But for intervals whose bound is zero to the last bit."""
    old, new = zip(*pairs, strict=True)
    opposite = {Verdict.WORSE: Verdict.BETTER, Verdict.BETTER: Verdict.WORSE}
    there, back = judge(old, new, limit, WAITING), judge(new, old, limit, WAITING)
    bounds = (there.difference.low or 1.0, there.difference.high or 1.0)
    if min(map(abs, bounds)) > 1e-9:
        assert back.verdict == opposite.get(there.verdict, there.verdict)


OUTCOMES = st.lists(
    st.tuples(
        st.sampled_from(["a", "b"]),
        st.sampled_from([None, 0.5, 1.0]),
        st.integers(1, 9),
        st.one_of(WAIT, st.none(), st.sampled_from(["failed", "crashed", "timed out", "skipped"])),
    ),
    max_size=30,
    unique_by=lambda one: one[:3],
)


def made(outcomes: list[tuple[str, float | None, int, float | str | None]]) -> list[Record]:
    return [
        unlucky(name, seed, status=outcome, rate=rate)
        if isinstance(outcome, str)
        else record(name, seed, waiting=outcome, rate=rate)
        for name, rate, seed, outcome in outcomes
    ]


@few
@given(outcomes=OUTCOMES, limit=LIMITS)
def test_equal_records_are_unchanged(outcomes: Any, limit: float) -> None:
    records = made(outcomes)
    found = compare(records, records, limit)
    assert {row.verdict for row in found.findings} <= {Verdict.UNCHANGED}
    assert not found.regressed
    assert len(found.findings) == len({one[:2] for one in outcomes})


@few
@given(old=OUTCOMES, new=OUTCOMES, seed=st.integers())
def test_the_order_of_records_does_not_matter(old: Any, new: Any, seed: int) -> None:
    before, after = made(old), made(new)
    found = compare(before, after, LIMIT, MEASURES)
    shuffle = random.Random(seed).shuffle
    shuffle(before)
    shuffle(after)
    assert compare(before, after, LIMIT, MEASURES) == found


@pytest.mark.parametrize("status", ["failed", "crashed", "timed out", "skipped"])
def test_an_episode_that_was_ok_and_is_not_is_a_new_failure(status: str) -> None:
    new = [*runs(BASE)[:-1], unlucky(seed=8, status=status, reason="no idea")]
    found = compared(runs(BASE), new)
    row = only(found)
    assert (row.verdict, row.seeds) == (Verdict.NEW_FAILURE, 7)
    assert row.remark == f"seed 8 {status}: no idea"
    assert found.exit_code == 1


def test_a_new_failure_comes_before_what_else_is_worse() -> None:
    new = [*runs(scaled(2.0))[:-2], *(unlucky(seed=seed, reason="x") for seed in (7, 8))]
    row = only(compared(runs(BASE), new))
    assert (row.verdict, row.remark) == (Verdict.NEW_FAILURE, "seed 7 failed: x (and 1 more)")


def test_a_figure_that_is_gone_is_a_new_failure() -> None:
    """Nobody arrives any more, so nobody's travel can be timed."""
    old = [record(seed=seed, travel_time=60.0) for seed in range(8)]
    new = [record(seed=seed, travel_time=None) for seed in range(8)]
    assert only(compared(old, new, KEYS["travel_time"])).verdict == Verdict.NEW_FAILURE
    assert only(compared(new, old, KEYS["travel_time"])).verdict == Verdict.FIXED
    assert only(compared(old, new)).verdict == Verdict.UNCHANGED


def test_an_episode_that_failed_and_is_ok_is_fixed_unless_others_are_worse() -> None:
    old = [*runs(BASE)[:-1], unlucky(seed=8)]
    found = compared(old, runs(BASE))
    assert (only(found).verdict, found.exit_code) == (Verdict.FIXED, 0)
    assert only(found).remark == "seeds that failed before: 1"
    assert only(compared(old, runs(scaled(2.0)))).verdict == Verdict.WORSE


def test_what_never_worked_is_unchanged_and_nothing_to_compare() -> None:
    old, new = [unlucky(seed=1)], [unlucky(seed=1, status="crashed")]
    found = compared(old, new)
    assert only(found).verdict == Verdict.UNCHANGED
    assert found.exit_code == 2
    assert compared([*old, *runs(BASE, scenario_hash="b" * 64)], new).exit_code == 2
    both = compared([*old, *runs(BASE, rate=1.0)], [*new, *runs(BASE, rate=1.0)])
    assert both.exit_code == 0


def test_rows_are_paired_by_controller_rate_and_seed_and_the_urgent_come_first() -> None:
    old = [
        *runs(BASE),
        *runs(scaled(2), rate=None),
        *runs(scaled(3), controller="d"),
        *runs(BASE, controller="e"),
    ]
    new = [
        *runs(scaled(1.5)),
        *runs(scaled(2), rate=None),
        *runs(scaled(2), controller="d"),
        *runs(BASE, controller="new"),
    ]
    found = compared(old, new[::-1])
    assert [(row.verdict, row.controller, row.rate) for row in found.findings] == [
        (Verdict.WORSE, "c", 0.5),
        (Verdict.MISSING, "e", 0.5),
        (Verdict.BETTER, "d", 0.5),
        (Verdict.UNCHANGED, "c", None),
    ]
    assert found.counts() == {
        Verdict.WORSE: 1,
        Verdict.MISSING: 1,
        Verdict.BETTER: 1,
        Verdict.UNCHANGED: 1,
    }


def test_another_scenario_of_the_same_name_is_not_comparable() -> None:
    found = compared(runs(BASE), runs(scaled(9), scenario_hash="b" * 64))
    assert only(found).verdict == Verdict.NOT_COMPARABLE
    assert only(found).remark == "the scenario is bbbbbbbb, was aaaaaaaa"
    assert found.exit_code == 2


def test_the_same_scenario_under_another_name_is_compared() -> None:
    row = only(
        compared(runs(BASE), runs(scaled(2), scenario="test/renamed", scenario_hash="a" * 64))
    )
    assert (row.verdict, row.scenario) == (Verdict.WORSE, "test/a")


def test_a_scenario_that_was_not_run_again_says_why() -> None:
    key = ("test/a", "a" * 64)
    row = only(compared(runs(BASE), [], incomparable={key: "gone"}))
    assert (row.verdict, row.remark) == (Verdict.NOT_COMPARABLE, "gone")


def test_seeds_without_a_new_record_are_told() -> None:
    found = compared(runs(BASE), runs(scaled(2))[:6])
    assert (only(found).verdict, only(found).seeds) == (Verdict.WORSE, 6)
    assert only(found).remark == "seeds without a new record: 2"
    assert compared(runs(BASE), []).exit_code == 2


def test_the_last_record_of_an_episode_counts() -> None:
    row = only(compared([*runs(scaled(9)), *runs(BASE)], [*runs(scaled(5)), *runs(BASE)]))
    assert (row.verdict, row.seeds) == (Verdict.UNCHANGED, 8)


def test_other_traffic_is_told() -> None:
    row = only(compared(runs(BASE, routes_hash="x"), runs(BASE, routes_hash="y")))
    assert (row.verdict, row.remark) == (
        *(Verdict.UNCHANGED, "its traffic differs from the reference's"),
    )


def test_each_junction_and_figure_has_a_row() -> None:
    def two(seed: int, east: float) -> Record:
        return record(seed=seed, junctions={"east": junction(east), "west": junction(9.0)})

    old, new = ([two(seed, wait) for seed in range(6)] for wait in (10.0, 20.0))
    found = compared(old, new, WAITING, THROUGHPUT)
    assert [(row.scenario, row.measure.key, row.verdict) for row in found.findings] == [
        ("test/a east", "average_waiting_time", Verdict.WORSE),
        ("test/a east", "throughput", Verdict.UNCHANGED),
        ("test/a west", "average_waiting_time", Verdict.UNCHANGED),
        ("test/a west", "throughput", Verdict.UNCHANGED),
    ]


def test_scenarios_of_one_name_and_several_hashes_stay_apart() -> None:
    old = [*runs(BASE, scenario_hash="b" * 64), *runs(BASE)]
    new = [*runs(scaled(2), scenario_hash="b" * 64), *runs(BASE)]
    found = compared(old, new)
    assert [row.verdict for row in found.findings] == [Verdict.WORSE, Verdict.UNCHANGED]
    assert compared(old[::-1], new[::-1]) == found
    apart = compared(old, runs(BASE))
    assert [row.verdict for row in apart.findings] == [Verdict.NOT_COMPARABLE, Verdict.UNCHANGED]


def test_nothing_against_nothing_is_nothing_to_compare() -> None:
    assert compared([], runs(BASE)).findings == ()
    assert compared([], []).exit_code == 2


def test_whole_trips_are_compared_once_for_the_network_of_several_junctions() -> None:
    def pair(north: float, time_loss: float) -> Record:
        both = {"N": junction(north), "S": junction(9.0)}
        return record(junctions=both, time_loss=time_loss)

    check = compared([pair(20.0, 30.0)], [pair(20.0, 33.0)], WAITING, KEYS["time_loss"])
    assert sorted((found.scenario, found.measure.key, found.new) for found in check.findings) == [
        ("test/a N", "average_waiting_time", 20.0),
        ("test/a S", "average_waiting_time", 9.0),
        ("test/a network", "time_loss", 33.0),
    ]

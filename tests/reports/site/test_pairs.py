"""Two controllers compared: paired by seed, and only where seeds suffice."""

import pytest
from factories.records import record, runs

from benchmark.records.leaderboard import REFERENCE
from benchmark.records.statistics import estimates
from benchmark.reports.site import pairs
from benchmark.reports.site.contents import MOST_PAIRS, Contents


def test_differences_are_paired_by_seed() -> None:
    ours, theirs = [1.0, 5.0, 2.0, 4.0, 3.0, 1.5], [2.0, 5.5, 4.0, 5.0, 3.5, 2.5]
    contents = Contents.of(
        [*runs(ours, controller="a"), *runs([*theirs, 99.0], controller="b")]
    )  # the seventh is alone
    (one,) = pairs.duels_of(contents, "a", "b")
    assert one.headline == estimates([[a - b for a, b in zip(ours, theirs, strict=True)]])[0]
    assert one.means == (pytest.approx(2.75), pytest.approx(3.75))
    (back,) = pairs.duels_of(contents, "b", "a")
    assert back.headline.mean == -one.headline.mean
    assert pairs.tally([one]) == pairs.Tally(1, 0, 0)
    assert pairs.tally([back]) == pairs.Tally(0, 1, 0)


def test_few_seeds_decide_nothing() -> None:
    found = pairs.duels_of(
        Contents.of([*runs([1, 2], controller="a"), *runs([8, 9], controller="b")]), "a", "b"
    )
    assert pairs.tally(found) == pairs.Tally(0, 0, 1)


def test_who_shares_no_seed_is_not_compared() -> None:
    assert pairs.duels_of(Contents.of([record("a", 1), record("b", 2)]), "a", "b") == []


def test_controllers_stand_in_the_order_of_whom_they_wait_less_than() -> None:
    everywhere = [
        record(name, rate=rate, waiting=wait * factor)
        for rate, factor in ((0.1, 20), (0.9, 1))
        for name, wait in (("good", 1), ("middling", 2), ("bad", 3))
    ]
    lucky = record("easy-only", rate=0.9, waiting=2.5)  # not run where everybody waits long
    contents = Contents.of([*everywhere, lucky, record("good?x=1", rate=0.1, waiting=0.1)])
    assert contents.controllers == ["good", "middling", "easy-only", "bad", "good?x=1"]
    assert contents.variants == ["good?x=1"]


def test_with_many_controllers_the_best_and_the_signal_have_pairs() -> None:
    names = [f"c{index:02}" for index in range(40)]
    records = [record(name, waiting=1.0 + index) for index, name in enumerate(names)]
    contents = Contents.of([*records, record(REFERENCE, rate=None, waiting=99.0)])
    found = set(contents.pairs)
    assert ("c00", "c01") in found
    assert ("c38", "c39") not in found
    assert all((name, REFERENCE) in found for name in names)
    assert len(found) <= MOST_PAIRS + len(names)

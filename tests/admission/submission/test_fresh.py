"""Fresh seeds are drawn so that nobody could foresee them, and again where chance may speak."""

from collections.abc import Callable, Sequence
from math import ceil, comb
from pathlib import Path
from typing import Any

import pytest
from factories.records import record, unlucky

from benchmark.admission.submission import fresh, manifest
from benchmark.admission.submission.checks import Bundle
from benchmark.control.training import FRESH_SEEDS, Training
from benchmark.records.record import Record

OLD = range(1, 21)


@pytest.fixture
def check(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[str, str, int]]:
    """Verdict, words, and how many draws were run, if these records are what they give."""

    def checked(*made: list[Record], submitted: Sequence[int] = OLD) -> tuple[str, str, int]:
        runs: list[Sequence[int]] = []

        def run(bundle: Bundle, how: Any, seeds: Sequence[int], workers: int) -> list[Record]:
            runs.append(seeds)
            return made[len(runs) - 1]

        monkeypatch.setattr(fresh, "_made", run)
        old = [record("a", seed, 10.0 + seed / 100, rate=0.4) for seed in submitted]
        bundle = Bundle(Path(), manifest.Manifest.model_construct(), old, {})
        drawn = [sorted({one.seed for one in some}) for some in made]
        found = fresh.fresh(bundle, fresh.Runner("a"), drawn, 1)
        return found.verdict, found.words, len(runs)

    return checked


def draw(first: int, wait: float) -> list[Record]:
    return [
        record("a", seed, wait + seed % 10 / 100, rate=0.4) for seed in range(first, first + 10)
    ]


def test_a_draw_that_may_be_chance_is_followed_by_another_and_both_decide(
    check: Callable[..., tuple[str, str, int]],
) -> None:
    assert check(draw(2000, 10.0), draw(2010, 90.0))[::2] == ("ok", 1)
    verdict, words, runs = check(draw(2000, 10.8), draw(2010, 9.4))
    assert (verdict, runs) == ("ok", 2)
    assert words.startswith("20 seeds, as 2000, 2001, 2002; at test/a rate 0.4 waits")
    verdict, words, runs = check(draw(2000, 90.0), draw(2010, 90.0))
    assert (verdict, runs) == ("failed", 2)
    assert words.startswith("does worse on 20 seeds")
    assert words.endswith("fitted to its own?")


def test_what_cannot_tell_is_no_check(check: Callable[..., tuple[str, str, int]]) -> None:
    verdict, words, _ = check(draw(2000, 10.0), submitted=(1, 2))
    assert verdict == "not checked"
    assert "too few seeds to tell: submit more" in words
    wild = [record("a", seed, 10.0 * 9 ** (seed % 3 - 1.2), rate=0.4) for seed in range(2000, 2010)]
    verdict, words, _ = check(wild, submitted=range(1, 21))
    assert verdict == "not checked"
    assert "too little to tell; 50% must be found: submit more seeds" in words


def test_episodes_that_end_badly_are_noted(check: Callable[..., tuple[str, str, int]]) -> None:
    verdict, words, _ = check([*draw(2000, 10.0), unlucky("a", seed=2011, rate=0.4)])
    assert verdict == "noted"
    assert "1 of 11 episodes do not end well" in words


def test_a_check_says_what_it_would_have_found(check: Callable[..., tuple[str, str, int]]) -> None:
    assert "; would find 1% longer waiting with 95%" in check(draw(2000, 10.0))[1]


def bundle_of(trained_on: tuple[Training, ...] | None = None) -> Bundle:
    said = manifest.Manifest.model_construct(trained_on=trained_on)
    return Bundle(Path(), said, [record("a", seed, 1.0, rate=0.4) for seed in OLD], {})


def test_draws_are_of_seeds_that_nobody_could_foresee() -> None:
    one, other = fresh.draws(10, bundle_of())
    assert len({*one, *other}) == 20
    assert all(seed in FRESH_SEEDS for seed in (*one, *other))
    assert len(FRESH_SEEDS) > 2**62
    assert fresh.draws(10, bundle_of()) != [one, other]
    assert fresh.draws(0, bundle_of()) == []


def test_seeds_that_are_asked_for_stand_in_the_first_draw_once() -> None:
    one, other = fresh.draws(3, bundle_of(), (7, 9, 7))
    assert {7, 9} < {*one}
    assert (len(one), len(other)) == (3, 3)
    assert fresh.draws(0, bundle_of(), (7, 9)) == [[7, 9]]


def test_a_declaration_takes_no_seed_from_the_draw() -> None:
    told = (Training(scenarios=("test",), first=0, last=2**63 - 1),)
    assert [len(draw) for draw in fresh.draws(2, bundle_of(told))] == [2, 2]


@pytest.mark.parametrize("total", [1, 2, 10, 19, 20, 21, 40, 100, 400, 9840])
def test_a_sample_meets_one_forged_record_in_twenty(total: int) -> None:
    forged, size = ceil(total / 20), fresh.sample_size(total)

    def missed(drawn: int) -> float:
        return comb(total - forged, drawn) / comb(total, drawn)

    assert missed(size) <= 0.05 < missed(size - 1)
    assert size <= min(total, 59)


def test_a_sample_is_drawn_anew_over_all_records() -> None:
    records = [record("a", seed, 1.0, rate=0.4) for seed in range(1, 101)]
    first, second = fresh.sample(records), fresh.sample(records)
    assert [one.seed for one in first] != [one.seed for one in second]
    assert fresh.sample(records, every=True) == records

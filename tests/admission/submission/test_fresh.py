"""Fresh seeds are drawn so that nobody could foresee them, and again where chance may speak."""

from collections.abc import Callable, Sequence
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
    return [record("a", seed, wait + seed % 10, rate=0.4) for seed in range(first, first + 10)]


def test_a_draw_that_may_be_chance_is_followed_by_another(
    check: Callable[..., tuple[str, str, int]],
) -> None:
    assert check(draw(2000, 5.0), draw(2010, 90.0))[::2] == ("ok", 1)
    verdict, words, runs = check(draw(2000, 90.0), draw(2010, 5.0))
    assert (verdict, runs) == ("ok", 2)
    assert "(p = 0.0001), and on seeds 2010, 2011" in words
    verdict, words, runs = check(draw(2000, 90.0), draw(2010, 90.0))
    assert (verdict, runs) == ("failed", 2)
    assert words.startswith("does worse on seeds 2000, 2001, 2002")
    assert words.endswith("fitted to its own?")


def test_what_cannot_tell_is_noted(check: Callable[..., tuple[str, str, int]]) -> None:
    verdict, words, _ = check(draw(2000, 90.0), submitted=(1, 2))
    assert verdict == "noted"
    assert words.endswith("too few seeds to tell")
    bad = [*draw(2000, 5.0), unlucky("a", seed=2011, rate=0.4)]
    verdict, words, _ = check(bad)
    assert verdict == "noted"
    assert "1 of 11 episodes do not end well" in words


def bundle_of(trained_on: tuple[Training, ...] | None = None) -> Bundle:
    said = manifest.Manifest.model_construct(trained_on=trained_on)
    return Bundle(Path(), said, [record("a", seed, 1.0, rate=0.4) for seed in OLD], {})


def test_draws_are_of_seeds_that_nobody_could_foresee() -> None:
    one, other = fresh.draws(10, bundle_of())
    assert len({*one, *other}) == 20
    assert {*one, *other} <= {*FRESH_SEEDS}
    assert fresh.draws(10, bundle_of()) != [one, other]
    assert fresh.draws(0, bundle_of()) == []


def test_seeds_that_are_asked_for_stand_in_the_first_draw_once() -> None:
    one, other = fresh.draws(3, bundle_of(), (7, 9, 7))
    assert {7, 9} < {*one}
    assert (len(one), len(other)) == (3, 3)
    assert fresh.draws(0, bundle_of(), (7, 9)) == [[7, 9]]


def test_what_it_was_trained_on_is_no_fresh_seed() -> None:
    last = FRESH_SEEDS.stop - 1
    told = (Training(scenarios=("test",), first=FRESH_SEEDS.start, last=last - 4),)
    one, other = fresh.draws(2, bundle_of(told))
    assert sorted((*one, *other)) == [*range(last - 3, last + 1)]

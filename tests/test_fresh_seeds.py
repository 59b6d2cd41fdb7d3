"""Fresh seeds: who is honest is not accused by chance, who was fitted to its seeds is found out."""

import random
from collections.abc import Iterable, Sequence
from math import comb
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_leaderboard import record, unlucky

from benchmark.record import Record
from benchmark.submission import fresh, manifest
from benchmark.submission.checks import Bundle


def waits(seeds: Iterable[int], first: float, step: float = 1.0) -> dict[int, float]:
    return {seed: first + step * index for index, seed in enumerate(seeds)}


OLD, NEW = range(1, 6), range(101, 104)


def test_fresh_seeds_that_wait_no_longer_prove_nothing() -> None:
    assert fresh.chance_of([waits(OLD, 10.0) | waits(NEW, 10.0)], NEW) > 0.4
    assert fresh.chance_of([waits((1, 2, 3), 10.0) | {101: 50.0}], [101]) == pytest.approx(
        1 / 4, abs=0.02
    )


def test_fresh_seeds_that_wait_longer_prove_something() -> None:
    cell = waits(OLD, 10.0) | waits(NEW, 90.0)
    assert fresh.chance_of([cell], NEW) == pytest.approx(1 / comb(8, 3), abs=0.004)


def test_many_cells_of_the_same_seeds_prove_no_more_than_one() -> None:
    cell = waits(OLD, 10.0) | waits(NEW, 90.0)
    assert fresh.chance_of([cell] * 20, NEW) == fresh.chance_of([cell], NEW)


def honest(seeds: Iterable[int], chance: random.Random, light: float) -> list[Record]:
    """Records of two cells in which traffic is heavy or light, of submitted seeds a little so."""
    traffic = {seed: light * chance.lognormvariate(0, 0.5) for seed in seeds}
    return [
        record("a", seed, wait * chance.lognormvariate(0, 0.1), rate=rate)
        for seed, wait in traffic.items()
        for rate in (0.4, 0.8)
    ]


def test_who_is_honest_is_seldom_accused() -> None:
    chance = random.Random(1)
    found = [
        fresh.compared(honest(range(1, 21), chance, 1.0), honest(range(31, 36), chance, 1.0))
        for _ in range(200)
    ]
    assert sum(one.is_worse for one in found) == 0  # 0.2 are expected
    assert all(one.can_tell for one in found)


def test_who_waits_much_longer_on_other_seeds_is_found_out() -> None:
    chance = random.Random(1)
    found = fresh.compared(honest(range(1, 21), chance, 1.0), honest(range(31, 36), chance, 8.0))
    assert found.is_worse
    assert found.seeds == [31, 32, 33, 34, 35]


def test_few_seeds_cannot_tell() -> None:
    chance = random.Random(1)
    for submitted, can_tell in ((8, False), (9, True)):
        old = honest(range(1, 1 + submitted), chance, 1.0)
        assert fresh.compared(old, honest(range(31, 36), chance, 9.0)).can_tell is can_tell


@given(
    cells=st.lists(
        st.tuples(
            st.lists(st.floats(0, 99), min_size=1, max_size=5),
            st.lists(st.floats(0, 99), min_size=1, max_size=3),
        ),
        min_size=1,
        max_size=3,
    )
)
def test_a_chance_is_a_chance_whatever_the_unit(
    cells: list[tuple[list[float], list[float]]],
) -> None:
    held = [dict(enumerate([*old, *new])) for old, new in cells]
    others = sorted({len(old) for old, _ in cells})[-1:]
    found = fresh.chance_of(held, others)
    assert 0 < found <= 1
    assert fresh.chance_of([{s: 4 * w for s, w in cell.items()} for cell in held], others) == found


# --- draw by draw --------------------------------------------------------------------------------


def checked(made: Sequence[list[Record]], monkeypatch: pytest.MonkeyPatch) -> tuple[str, str, int]:
    """Verdict, words, and how many draws were run, if these are what they give."""
    runs: list[Sequence[int]] = []

    def run(bundle: Bundle, how: Any, seeds: Sequence[int], workers: int) -> list[Record]:
        runs.append(seeds)
        return made[len(runs) - 1]

    monkeypatch.setattr(fresh, "_made", run)
    old = [record("a", seed, 10.0 + seed, rate=0.4) for seed in range(1, 21)]
    bundle = Bundle(Path(), manifest.Manifest.model_construct(), old, {})
    drawn = [[*{one.seed for one in some}] for some in made]
    found = fresh.fresh(bundle, fresh.Runner("a"), drawn, 1)
    return found.verdict, found.words, len(runs)


def at(first: int, wait: float) -> list[Record]:
    return [record("a", seed, wait + seed / 100, rate=0.4) for seed in range(first, first + 5)]


def test_a_draw_that_may_be_chance_is_followed_by_another(monkeypatch: pytest.MonkeyPatch) -> None:
    assert checked([at(31, 20.0), at(41, 90.0)], monkeypatch)[::2] == ("ok", 1)
    verdict, words, runs = checked([at(31, 90.0), at(41, 20.0)], monkeypatch)
    assert (verdict, runs) == ("ok", 2)
    assert "p = 0.000), and seeds 41, 42, 43, 44, 45: waits 20.4 s" in words
    verdict, words, runs = checked([at(31, 90.0), at(41, 90.0)], monkeypatch)
    assert (verdict, runs) == ("failed", 2)
    assert words.startswith("waits longer on seeds 31, 32, 33, 34, 35: waits 90.3 s")


def test_an_episode_that_does_not_end_well_fails_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    bad = [*at(31, 1.0), unlucky("a", rate=0.4)]
    verdict, words, runs = checked([bad, at(41, 1.0)], monkeypatch)
    assert (verdict, runs) == ("failed", 1)
    assert "1 of 6 episodes did not end well" in words


def test_draws_have_no_seed_in_common_and_none_that_was_submitted() -> None:
    old = [record("a", seed, 1.0, rate=0.4) for seed in range(1, 21)]
    bundle = Bundle(Path(), manifest.Manifest.model_construct(), old, {})
    one, other = fresh.draws(bundle, 5)
    assert len({*one, *other, *range(1, 21)}) == 30
    assert fresh.draws(bundle, 0) == []

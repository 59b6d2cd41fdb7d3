"""Fresh seeds: who is honest is not accused by chance, who was fitted to its seeds is found out."""

import random
from collections.abc import Collection, Iterable, Mapping, Sequence
from math import comb, exp, sqrt

import pytest
from factories.records import record, unlucky
from hypothesis import given
from hypothesis import strategies as st

from benchmark.admission.submission import comparison
from benchmark.admission.submission.comparison import Comparison
from benchmark.records.record import Record

OLD, NEW = range(1, 21), range(2001, 2011)


def chance_of(cells: Sequence[Mapping[int, float]], new: Sequence[int]) -> float:
    return comparison.chance_of(*comparison.scores(cells, new))


def waits(seeds: Iterable[int], first: float) -> dict[int, float]:
    return {seed: first + index for index, seed in enumerate(seeds)}


def test_fresh_seeds_that_wait_no_longer_prove_nothing() -> None:
    assert chance_of([waits(OLD, 10.0) | waits(NEW, 10.0)], NEW) > 0.4
    same = dict.fromkeys((*OLD, *NEW), 7.0)
    assert chance_of([same], NEW) == 1.0


def test_the_chance_of_the_worst_order_is_one_in_as_many_as_there_are() -> None:
    old, new = range(1, 6), range(101, 104)
    cell = waits(old, 10.0) | waits(new, 90.0)
    assert chance_of([cell], new) == pytest.approx(1 / comb(8, 3), abs=0.004)


def test_many_cells_of_the_same_traffic_prove_no_more_than_one() -> None:
    old, new = range(1, 6), range(101, 104)
    cell = waits(old, 10.0) | waits(new, 90.0)
    assert chance_of([cell] * 20, new) == chance_of([cell], new)


def test_a_cell_may_lack_seeds() -> None:
    cell = waits(OLD, 10.0) | waits(NEW, 90.0)
    part = {seed: wait for seed, wait in cell.items() if seed % 2}
    assert chance_of([part, cell], NEW) < 0.001


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
def test_a_chance_is_a_chance_whatever_the_order_of_cells(
    cells: list[tuple[list[float], list[float]]],
) -> None:
    held = [
        dict(enumerate(old)) | {100 + seed: wait for seed, wait in enumerate(new)}
        for old, new in cells
    ]
    new = [seed for seed in held[0] if seed >= 100]
    found = chance_of(held, new)
    assert 0 < found <= 1
    assert chance_of(held[::-1], new) == pytest.approx(found, abs=0.001)


RATES = (0.4, 0.8, 1.0)


def traffic(
    seeds: Iterable[int], chance: random.Random, worse: Mapping[float, float] = {}
) -> list[Record]:
    """Records of cells in which the same traffic is heavy or light."""
    heavy = {seed: 10 * chance.lognormvariate(0, 0.5) for seed in seeds}
    return [
        record("a", seed, wait * worse.get(rate, 1.0) * chance.lognormvariate(0, 0.1), rate=rate)
        for seed, wait in heavy.items()
        for rate in RATES
    ]


def against(
    worse: Mapping[float, float], old: Sequence[int] = OLD, new: Sequence[int] = NEW
) -> Comparison:
    chance = random.Random(1)
    return Comparison(traffic(old, chance), traffic(new, chance, worse))


def test_who_is_honest_is_seldom_accused() -> None:
    chance = random.Random(1)
    found = [Comparison(traffic(OLD, chance), traffic(NEW, chance)) for _ in range(100)]
    assert not any(one.speaks_against for one in found)  # 0.1 are expected
    assert sum(one.is_suspicious for one in found) <= 10  # 5 are expected


def test_who_waits_much_longer_on_other_seeds_is_found_out() -> None:
    found = against(dict.fromkeys(RATES, 5.0))
    assert found.speaks_against
    assert found.seeds == [*NEW]


def test_who_was_fitted_to_one_cell_is_found_out_there() -> None:
    found = against({0.8: 8.0})
    assert found.speaks_against
    assert "at test/a rate 0.8 waits" in found.words


def test_a_small_difference_in_one_cell_hides_no_large_one_in_another() -> None:
    chance = random.Random(1)
    sure = [record("a", s, 10.0 + s / 1e4, rate=0.1) for s in OLD]
    small = [record("a", s, 10.5 + s / 1e6, rate=0.1) for s in NEW]  # 5 %, on every seed
    old, new = traffic(OLD, chance), traffic(NEW, chance, {0.8: 8.0})
    found = Comparison([*old, *sure], [*new, *small])
    assert found.speaks_against
    assert "at test/a rate 0.8 waits" in found.words


def test_what_only_one_side_has_is_not_compared() -> None:
    chance = random.Random(1)
    old = [*traffic(OLD, chance), *(record("a", s, 10.0, rate=0.1) for s in OLD)]
    new = [*traffic(NEW, chance), *(record("a", s, 900.0, rate=0.2) for s in NEW)]
    found = Comparison(old, new)
    assert {rate for _, rate, _ in found.cells} == {*RATES}
    assert not found.speaks_against


def test_a_jam_that_both_have_hides_nothing() -> None:
    jam = [record("a", seed, 500.0 + seed, rate=0.1) for seed in (*OLD, *NEW)]
    found = against({0.8: 8.0})
    old, new = (
        [*some, *(one for one in jam if one.seed in seeds)]
        for some, seeds in ((found.submitted, OLD), (found.made, NEW))
    )
    assert Comparison(old, new).speaks_against


def test_a_difference_that_is_sure_but_small_is_no_matter() -> None:
    old = [record("a", seed, 10.0 + seed / 1000, rate=0.4) for seed in OLD]
    new = [record("a", seed, 10.2 + seed / 10_000, rate=0.4) for seed in NEW]
    found = Comparison(old, new)
    assert found.chance < 0.001
    assert not found.speaks_against
    more = [record("a", seed, 12.5 + seed / 10_000, rate=0.4) for seed in NEW]  # 12 %
    assert Comparison(old, more).speaks_against


def test_each_junction_is_a_cell_of_its_own() -> None:
    def two(seed: int, wait: float) -> Record:
        one = record("a", seed, 10.0, rate=0.4)
        (junction,) = one.junctions.values()
        other = junction.model_copy(update={"average_waiting_time": wait})
        return one.model_copy(update={"junctions": {"first": junction, "second": other}})

    found = Comparison([two(s, 5.0 + s / 100) for s in OLD], [two(s, s / 10) for s in NEW])
    assert {junction for _, _, junction in found.cells} == {"first", "second"}
    assert found.speaks_against


def test_few_seeds_cannot_tell() -> None:
    for submitted, can_tell in ((3, False), (8, True)):
        old = [record("a", seed, 10.0 + seed % 3, rate=0.4) for seed in range(submitted)]
        new = [record("a", seed, 10.0 + seed % 3, rate=0.4) for seed in NEW]
        assert Comparison(old, new).can_tell is can_tell
    assert not against({}).can_tell  # traffic that differs by half between seeds


def test_what_is_found_follows_from_the_deviation_between_seeds() -> None:
    chance = random.Random(1)
    old, new = range(1, 1001), range(2001, 3001)
    waits = {seed: 10 * chance.lognormvariate(0, 0.1) for seed in (*old, *new)}
    found = Comparison(
        *([record("a", seed, waits[seed], rate=0.4) for seed in seeds] for seeds in (old, new))
    )
    expected = exp((3.0902 + 1.6449) * 0.1 * sqrt(2 / 1000)) - 1
    assert found.finds() == pytest.approx(expected, rel=0.07)
    assert found.finds(more=1000) < found.finds()


def test_who_does_18_percent_better_on_its_own_seeds_is_found_out() -> None:
    chance = random.Random(1)

    def steady(seeds: Iterable[int], share: float) -> list[Record]:
        return [
            record("a", seed, share * 10 * chance.lognormvariate(0, 0.1), rate=rate)
            for seed in seeds
            for rate in RATES
        ]

    old, fresh = range(1, 21), range(2001, 2061)
    assert not any(
        Comparison(steady(old, 1.0), steady(fresh, 1.0)).speaks_against for _ in range(20)
    )
    assert all(
        Comparison(steady(old, 1 / 1.18), steady(fresh, 1.0)).speaks_against for _ in range(20)
    )


def failing(
    seeds: Sequence[int], bad: Collection[int], rates: Sequence[float] = RATES
) -> list[Record]:
    """Records of which those of some seeds failed, in every cell."""
    return [
        unlucky("a", seed=seed, rate=rate) if seed in bad else record("a", seed, 10.0, rate=rate)
        for seed in seeds
        for rate in rates
    ]


def test_seeds_that_end_badly_speak_against_it_where_they_are_more_than_before() -> None:
    assert not Comparison(failing(OLD, ()), failing(NEW, NEW[:1])).speaks_against
    assert Comparison(failing(OLD, ()), failing(NEW, NEW[:9])).speaks_against
    assert not Comparison(failing(OLD, OLD[:15]), failing(NEW, NEW[:9])).fails_more_often
    assert "3 of 30 episodes do not end well, such as test/a rate 0.4 seed 2001: failed" in (
        Comparison(failing(OLD, ()), failing(NEW, NEW[:1])).words
    )


def test_a_seed_that_ends_badly_in_many_cells_counts_once() -> None:
    many = [index / 100 for index in range(1, 17)]
    old, new = failing(OLD, OLD[:1], many), failing(NEW, NEW[:3], many)
    assert not Comparison(old, new).fails_more_often


def test_cells_that_never_ran_well_hide_no_failures() -> None:
    elsewhere = [unlucky("a", seed=seed, rate=0.1, status="skipped") for seed in OLD]
    elsewhere += [unlucky("a", seed=seed, rate=0.2) for seed in OLD]
    assert Comparison([*failing(OLD, ()), *elsewhere], failing(NEW, NEW)).speaks_against


def test_who_stays_away_from_fresh_seeds_fails_there() -> None:
    away = [unlucky("a", seed=seed, rate=rate, status="skipped") for seed in NEW for rate in RATES]
    assert Comparison(failing(OLD, ()), away).fails_more_often


def test_seeds_of_which_nothing_is_known_cannot_tell() -> None:
    assert not Comparison(failing(OLD, OLD[2:]), failing(NEW, ())).can_tell


def test_nothing_to_compare_speaks_against_nobody() -> None:
    found = Comparison(
        [unlucky("a", seed=1, rate=0.4)], [unlucky("a", seed=seed, rate=0.4) for seed in NEW]
    )
    assert not found.speaks_against
    assert not found.can_tell
    assert "10 of 10 episodes do not end well" in found.words

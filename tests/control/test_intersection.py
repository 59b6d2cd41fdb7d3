"""The facts of an intersection: movements, lanes and the sets that may go together."""

from itertools import chain, combinations

import pytest
from factories.traffic import CONFLICT_FREE, CROSSROADS, crossroads
from hypothesis import given
from hypothesis import strategies as st

REGULATED = ("N-L", "N-C", "E-L", "E-C", "S-L", "S-C", "W-L", "W-C")
PAIRS = [frozenset(pair) for pair in combinations(REGULATED, 2)]


def test_left_and_cross_movements_are_regulated_and_right_turns_are_not() -> None:
    assert CROSSROADS.regulated_movements == REGULATED
    assert not any(CROSSROADS.movements[f"{letter}-R"].regulated for letter in "NESW")


def test_lanes_that_serve_a_regulated_movement_are_regulated() -> None:
    assert set(CROSSROADS.lanes) - set(CROSSROADS.regulated_lanes) == {
        f"{approach}_0" for approach in ("northbound", "eastbound", "southbound", "westbound")
    }


def test_a_movement_knows_its_lanes() -> None:
    assert CROSSROADS.movements["E-C"].lanes == ("eastbound_1", "eastbound_2")


def test_the_conflict_free_sets_are_the_papers_pairs() -> None:
    sets = CROSSROADS.conflict_free_sets
    assert len(sets) == len(CONFLICT_FREE)
    assert set(sets) == CONFLICT_FREE


@pytest.mark.parametrize(
    ("conflicts", "sets"),
    [([], {frozenset(REGULATED)}), (PAIRS, {frozenset({name}) for name in REGULATED})],
    ids=["no conflict", "all conflict"],
)
def test_conflict_free_sets_at_the_extremes(
    conflicts: list[frozenset[str]], sets: set[frozenset[str]]
) -> None:
    assert set(crossroads(conflicts).conflict_free_sets) == sets


@given(conflicts=st.sets(st.sampled_from(PAIRS)))
def test_conflict_free_sets_are_the_largest_that_no_conflict_splits(
    conflicts: set[frozenset[str]],
) -> None:
    everything = chain.from_iterable(combinations(REGULATED, size) for size in range(1, 9))
    free = [
        frozenset(chosen)
        for chosen in everything
        if not any(frozenset(pair) in conflicts for pair in combinations(chosen, 2))
    ]
    largest = {one for one in free if not any(one < other for other in free)}
    found = crossroads(conflicts).conflict_free_sets
    assert len(found) == len(set(found))
    assert set(found) == largest

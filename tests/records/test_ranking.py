"""Controllers stand in the order of the places that they have in common."""

from factories.records import record, unlucky
from hypothesis import given
from hypothesis import strategies as st

from benchmark.records.leaderboard import rows_of_records
from benchmark.records.ranking import ranking


def order(waits: dict[str, dict[float, float | None]]) -> list[str]:
    """Of controllers by their waiting at rates; None for an episode that failed."""
    return ranking(
        rows_of_records(
            [
                unlucky(name, rate=rate) if waiting is None else record(name, 1, waiting, rate)
                for name, places in waits.items()
                for rate, waiting in places.items()
            ]
        )
    )


def test_who_ran_only_where_it_is_easy_does_not_stand_above_all() -> None:
    everywhere = {0.1: 300.0, 0.5: 8.0, 0.7: 4.0}
    assert order({"variant": {0.5: 9.0, 0.7: 5.0}, "whole": everywhere}) == ["whole", "variant"]


def test_where_nothing_is_common_those_who_ran_most_places_come_first() -> None:
    assert order({"a": {0.1: 1.0}, "b": {0.5: 9.0, 0.7: 9.0}, "c": {0.5: 8.0, 0.7: 8.0}}) == [
        *("c", "b", "a")
    ]


def test_who_has_no_figures_stands_last_and_does_not_unsettle_the_others() -> None:
    assert order({"none": {0.5: None}, "b": {0.5: 2.0}, "a": {0.5: 3.0}}) == ["b", "a", "none"]


@given(
    st.dictionaries(
        st.sampled_from("abcd"),
        st.dictionaries(st.sampled_from([0.1, 0.5, 0.9]), st.floats(0, 99), min_size=1),
        min_size=1,
    )
)
def test_everybody_stands_once(waits: dict[str, dict[float, float | None]]) -> None:
    assert sorted(order(waits)) == sorted(waits)

"""Bars of intervals keep to one scale."""

from factories.records import record
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmark.reports.site import intervals
from benchmark.reports.site.contents import Contents


@settings(max_examples=25)
@given(st.lists(st.floats(0, 1e5), min_size=2, max_size=9, unique=True))
def test_bars_stay_on_their_rail_and_in_order(waits: list[float]) -> None:
    rows = Contents.of([record(f"c{i}", waiting=wait) for i, wait in enumerate(waits)]).rows
    scale = intervals.Scale.of(rows)
    places = [scale.place(wait) for wait in sorted(waits)]
    assert places == sorted(places)
    assert places[0] >= 0
    assert places[-1] <= intervals.WIDTH

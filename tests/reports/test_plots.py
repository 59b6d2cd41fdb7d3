"""The figures of a results folder: what they show."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from factories.records import junction, record, study, unlucky
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmark.records import table
from benchmark.records.record import Record, Waiting
from benchmark.reports.plots import comparison, gallery, style, traffic, training, waiting
from benchmark.reports.plots.data import Data, Wish


def data(records: Iterable[Record], **wish: Any) -> Data:
    held = list(records)
    return Data(
        table.records_table(held),
        lambda names: (r for r in held if r.scenario in names),
        Wish(**wish),
    )


def test_boxes_hold_the_seeds_of_each_controller_and_lines_the_signals() -> None:
    figure = waiting.boxes(data(study(a=[30.0, 10.0], b=[5.0, 2.0])))
    assert figure is not None
    (axes,) = (one for one in figure.axes if one.get_visible())
    medians = sorted(one.get_ydata()[0] for one in axes.lines if one.get_linewidth() == 1.3)
    assert medians == pytest.approx([2.4, 5.4, 10.4, 30.4])
    signal = [one for one in axes.lines if list(one.get_xdata()) == [0, 1]]
    assert [one.get_ydata()[0] for one in signal] == [pytest.approx(20.4)]
    assert [one.get_text() for one in axes.get_xticklabels()] == ["10 %", "20 %"]


def test_episodes_that_jammed_and_waits_of_nothing_stay_in_the_picture() -> None:
    figure = waiting.boxes(
        data([*study(a=[30.0]), *(record("a", 20 + n, 900.0 * n, rate=0.1) for n in (0, 1))])
    )
    assert figure is not None
    low, high = figure.axes[0].get_ylim()
    assert low <= waiting.SHORTEST < 900.0 <= high
    assert figure.axes[0].get_yscale() == "log"


def test_improvement_is_the_reduction_against_the_signal() -> None:
    figure = comparison.improvement(data(study(a=[9.8, 40.8])))
    assert figure is not None
    assert [one.get_text() for one in figure.axes[0].texts] == ["50", "-102"]


def test_a_reduction_that_may_be_chance_says_so() -> None:
    few = [one for one in study(a=[9.8]) if one.seed < 4]
    figure = comparison.improvement(data(few))
    assert figure is not None
    assert [one.get_text() for one in figure.axes[0].texts] == ["50?"]


@pytest.mark.parametrize(
    ("means", "rate"),
    [
        ([10.0, -10.0, -10.0], 0.15),
        ([10.0, -30.0, -10.0], 0.125),
        ([-5.0, 10.0, -10.0], 0.25),  # the last time counts
        ([-1.0, -2.0, -3.0], -math.inf),
        ([1.0, -2.0, 3.0], math.inf),
        ([1.0, 0.0, -3.0], 0.2),
    ],
)
def test_the_crossover_is_where_waiting_falls_below_for_good(
    means: list[float], rate: float
) -> None:
    found = comparison.crossover([0.1, 0.2, 0.3], np.array([means] * 7))
    assert (found.low, found.rate, found.high) == pytest.approx((rate, rate, rate))


@settings(max_examples=30)
@given(st.lists(st.tuples(*[st.floats(-50, 50)] * 3), min_size=2, max_size=8))
def test_the_interval_of_a_crossover_lies_among_what_seeds_may_give(
    rows: list[tuple[float, float, float]],
) -> None:
    found = comparison.crossover([0.1, 0.2, 0.3], np.array(rows))
    assert found.low <= found.high
    for each in (found.low, found.rate, found.high):
        assert math.isinf(each) or 0.1 <= each <= 0.3


def test_crossovers_are_paired_by_seed_and_need_two_rates() -> None:
    found = comparison.crossovers(data(study(a=[30.0, 10.0], b=[5.0])))
    assert found.keys() == {("test/a", "a")}
    assert found["test/a", "a"].rate == pytest.approx(0.15)


def test_figures_at_one_rate_show_curves_and_movements_there() -> None:
    shown = data(study(a=[30.0, 10.0]), rate=0.2)
    curves, bars = traffic.unregulated(shown), traffic.movements(shown)
    assert curves is not None
    assert [list(one.get_ydata()) for one in curves.axes[0].lines] == [[1.0, 0.5]]
    assert bars is not None
    assert [one.get_height() for one in bars.axes[0].patches] == [pytest.approx(10.0)]
    assert traffic.unregulated(data(study(a=[30.0]), rate=0.7)) is None


def test_the_newest_record_counts_and_failures_are_left_out() -> None:
    old, new = study(a=[30.0]), study(a=[10.0])
    found = data([*old, *new, unlucky("b", rate=0.1)])
    assert found.values("average_waiting_time", "test/a", 0.1, "a")[1] == pytest.approx(10.1)
    assert found.values("average_waiting_time", "test/a", 0.1, "b") == {}


def test_a_figure_with_nothing_to_show_is_none() -> None:
    nothing = data([unlucky("a", rate=0.1)])
    for kind in gallery.KINDS:
        assert kind.draw(nothing, {}) is None
    assert comparison.improvement(data([one for one in study(a=[1.0]) if one.rate])) is None


def test_a_single_record_makes_a_figure() -> None:
    with style.styled():
        assert waiting.boxes(data([record()])) is not None
        assert waiting.throughput(data([record()])) is not None


def test_rows_of_edited_code_keep_their_curves() -> None:
    records = [
        one.model_copy(update={"controller_from": f"a 1.0 sha256:{digit * 64}"})
        for digit in "12"
        for one in study(a=[5.0])
        if one.rate
    ]
    both = data([*records[:3], *records[-3:]], rate=0.1)
    assert both.controllers == ["a (11111111)", "a (22222222)"]
    assert all(both.junctions("test/a", 0.1, name) for name in both.controllers)
    assert traffic.unregulated(both) is not None


def test_junctions_are_drawn_apart() -> None:
    both = {
        name: junction(10.0, unregulated_lane_curve=(share,))
        for name, share in (("N", 0.25), ("S", 0.75))
    }
    shown = data([record("a", seed, junctions=both) for seed in range(1, 8)], rate=0.5)
    assert shown.scenarios == ["test/a N", "test/a S"]
    figure = traffic.unregulated(shown)
    assert figure is not None
    shares = [line.get_ydata()[0] for axes in figure.axes for line in axes.lines]
    assert shares == [0.25, 0.75]


def test_a_few_controllers_are_chosen_where_none_are_asked_for() -> None:
    records = study(**{f"c{number}": [10.0 - number] for number in range(10)})
    assert data(records).controllers == ["c9", "c8", "c7", "c6", "c5"]  # the least waiting first
    assert data(records, controllers=("c7", "traffic-light")).controllers == ["c7"]
    assert data(records).controllers_left_out == 5
    assert data(records, controllers=("c7",)).controllers_left_out == 9
    assert data(records).signals == ["traffic-light"]
    options = [record("x?a=1"), record("x?a=2", seed=2)]
    assert data(options).controllers == ["x?a=1", "x?a=2"]


def test_curves_are_found_by_run_and_holes_are_left_out(tmp_path: Path) -> None:
    for name, text in (("one", "rollout/waiting,other\n5,\n,1\n3,2\n"), ("two", "x\n1\n")):
        (tmp_path / name / "logs").mkdir(parents=True)
        (tmp_path / name / "logs" / "progress.csv").write_text(text)
    found = training.training_logs([tmp_path])
    assert list(found) == ["one", "two"]
    figure = training.training_curves(found)
    assert figure is not None
    (line,) = figure.axes[0].lines
    assert (list(line.get_xdata()), list(line.get_ydata())) == ([1, 3], [5.0, 3.0])
    assert training.training_curves({"two": found["two"]}) is None


def test_movements_stand_beside_the_signals_at_the_rate_that_was_run() -> None:
    waits = {"N-C": Waiting(mean=12.0, p95=1, maximum=1, vehicles=2)}
    light = record("traffic-light", rate=None, waiting_by_movement=waits)
    figure = traffic.movements(data([*study(a=[30.0, 10.0]), light]))
    assert figure is not None
    assert sorted(bar.get_height() for bar in figure.axes[0].patches) == [10.0, 12.0]
    assert [text.get_text() for text in figure.legends[0].texts] == ["a", "traffic-light"]
    alone = traffic.movements(data([light]))
    assert alone is not None
    assert [bar.get_height() for bar in alone.axes[0].patches] == [12.0]


def test_the_words_beside_the_colours_of_one_scenario_fit_the_figure() -> None:
    figure = comparison.improvement(data(study(a=[9.8])))
    assert figure is not None
    figure.canvas.draw()
    words = figure.get_supxlabel()
    assert "the interval holds zero" in words
    box = figure._supxlabel.get_window_extent()
    assert 0 <= box.x0 < box.x1 <= figure.bbox.width

"""Means over seeds and their intervals."""

import math
import tracemalloc
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmark.records.statistics import ENOUGH, Estimate, estimates, hourly_probability, reductions

VALUES = st.floats(-1e6, 1e6)
SAMPLE = st.lists(VALUES, min_size=1, max_size=12)
few = settings(max_examples=25)


def estimate(sample: Sequence[float]) -> Estimate:
    (found,) = estimates([sample])
    return found


def drawn(count: int, size: int, seed: int = 1) -> list[list[float]]:
    """Samples of normal data with mean 50."""
    return np.random.default_rng(seed).normal(50, 20, (count, size)).tolist()


@pytest.mark.parametrize("value", [0.0, -3.5, 1e9])
def test_a_single_value_has_no_interval(value: float) -> None:
    found = estimate([value])
    assert found == Estimate(mean=value, low=None, high=None, count=1)
    assert not found.excludes_zero


@pytest.mark.parametrize("size", [2, 3, 10, 30])
@pytest.mark.parametrize("value", [0.0, 0.1, -7.3, 1e9])
def test_a_constant_sample_has_an_interval_without_width(value: float, size: int) -> None:
    found = estimate([value] * size)
    assert found.mean == pytest.approx(value)
    assert found.low == found.high == found.mean
    assert found.count == size
    assert found.excludes_zero == (value != 0 and size >= ENOUGH)


def test_no_samples_give_no_estimates() -> None:
    assert estimates([]) == []


def test_two_values_have_themselves_as_interval() -> None:
    """A resample is both values with chance 1/2 and one of them twice with chance 1/4 each."""
    assert estimate([1.0, 3.0]) == Estimate(mean=2.0, low=1.0, high=3.0, count=2)


def test_an_interval_agrees_with_drawing_with_replacement_in_a_loop() -> None:
    (sample,) = drawn(1, 10)
    rng = np.random.default_rng(7)
    means = sorted(float(np.mean(rng.choice(sample, len(sample)))) for _ in range(20_000))
    found = estimate(sample)
    spread = np.std(sample) / len(sample) ** 0.5
    assert found.mean == pytest.approx(np.mean(sample))
    assert found.low == pytest.approx(means[500], abs=0.1 * spread)
    assert found.high == pytest.approx(means[-501], abs=0.1 * spread)


@few
@given(sample=SAMPLE)
def test_an_interval_lies_within_the_sample_and_holds_the_mean(sample: list[float]) -> None:
    found = estimate(sample)
    assert found.mean == pytest.approx(sum(sample) / len(sample), abs=1e-6)
    if len(sample) > 1:
        margin = 1e-9 * (1 + max(map(abs, sample)))
        assert found.low is not None
        assert found.high is not None
        assert min(sample) - margin <= found.low <= found.mean + margin
        assert found.mean - margin <= found.high <= max(sample) + margin


@few
@given(sample=st.lists(VALUES, min_size=2, max_size=12))
def test_the_opposite_sample_has_the_opposite_interval(sample: list[float]) -> None:
    found, other = estimate(sample), estimate([-value for value in sample])
    ends = (-found.mean, -(found.high or 0), -(found.low or 0))
    assert (other.mean, other.low, other.high) == pytest.approx(ends, abs=1e-6)


@few
@given(samples=st.lists(SAMPLE, max_size=6))
def test_an_estimate_is_the_same_whatever_else_is_asked_for(samples: list[list[float]]) -> None:
    assert estimates(samples) == [estimate(sample) for sample in samples]
    assert estimates(samples[::-1]) == estimates(samples)[::-1]


@pytest.mark.parametrize("size", [2, 6, 10, 33])
def test_estimates_agree_to_the_last_bit_alone_and_among_others(size: int) -> None:
    samples = drawn(20, size)
    together = estimates(samples)
    assert together == estimates(samples)
    assert together == [estimate(sample) for sample in samples]


def test_an_estimate_does_not_depend_on_what_was_drawn_before() -> None:
    (sample,) = drawn(1, 10)
    first = estimate(sample)
    np.random.default_rng().normal(size=99)
    estimates(drawn(3, 4))
    assert estimate(tuple(sample)) == first


@pytest.mark.parametrize(("size", "least", "most"), [(10, 0.85, 0.97), (30, 0.90, 0.98)])
def test_about_95_percent_of_intervals_hold_the_true_mean(
    size: int, least: float, most: float
) -> None:
    """The percentile bootstrap falls short for few values: about 90 % for ten."""
    found = estimates(drawn(300, size))
    hits = [one.low is not None and one.low <= 50 <= (one.high or 0) for one in found]
    assert least < np.mean(hits) < most


@pytest.mark.parametrize("size", range(1, 9))
def test_too_few_values_never_exclude_zero(size: int) -> None:
    for sign in (1, -1):
        assert estimate([sign * (5.0 + seed) for seed in range(size)]).excludes_zero == (
            size >= ENOUGH
        )


@pytest.mark.parametrize(
    ("low", "high", "excludes"),
    [
        *((0.1, 2.0, True), (-2.0, -0.1, True), (-1.0, 1.0, False)),
        *((0.0, 2.0, False), (-2.0, 0.0, False), (0.0, 0.0, False)),
    ],
)
def test_an_interval_that_touches_zero_does_not_exclude_it(
    low: float, high: float, excludes: bool
) -> None:
    assert Estimate(1.0, low, high, ENOUGH).excludes_zero == excludes


def test_many_samples_take_little_memory() -> None:
    """A leaderboard asks for ten thousand."""
    samples = drawn(500, 10)
    tracemalloc.start()
    try:
        estimates(samples)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 50e6


def reduction(ours: Sequence[float], baseline: Sequence[float]) -> Estimate:
    (found,) = reductions([(ours, baseline)])
    assert found is not None
    return found


@pytest.mark.parametrize("share", [0.8, 0.25, 0.0, -1.5])
def test_the_same_share_less_at_every_seed_is_certain(share: float) -> None:
    (baseline,) = drawn(1, 12)
    found = reduction([(1 - share) * value for value in baseline], baseline)
    assert (found.mean, found.low, found.high) == pytest.approx((share,) * 3)
    assert found.excludes_zero == (share != 0)


def test_a_reduction_compares_means_not_seeds() -> None:
    """One seed that jams counts in full: the mean of the seeds' own shares would be 25 %."""
    assert reduction([10, 100], [20, 100]).mean == pytest.approx(1 - 110 / 120)


def test_pairing_makes_a_reduction_surer() -> None:
    (baseline,) = drawn(1, 20)
    ours = [0.9 * value for value in baseline]
    paired, shuffled = reduction(ours, baseline), reduction(ours[::-1], baseline)
    assert paired.mean == pytest.approx(shuffled.mean) == pytest.approx(0.1)
    assert paired.excludes_zero
    assert not shuffled.excludes_zero


def test_an_interval_of_a_reduction_agrees_with_drawing_seeds_in_a_loop() -> None:
    ours, baseline = drawn(2, 10)
    rng = np.random.default_rng(7)
    shares = []
    for _ in range(20_000):
        seeds = rng.integers(10, size=10)
        shares.append(1 - np.mean(np.array(ours)[seeds]) / np.mean(np.array(baseline)[seeds]))
    found = reduction(ours, baseline)
    spread = float(np.std(shares))
    assert found.low == pytest.approx(np.quantile(shares, 0.025), abs=0.15 * spread)
    assert found.high == pytest.approx(np.quantile(shares, 0.975), abs=0.15 * spread)


def test_a_reduction_needs_something_to_divide_by() -> None:
    assert reductions([([], []), ([1.0, 2.0], [0.0, 3.0])]) == [None, None]
    assert reductions([([3.0], [4.0])]) == [Estimate(0.25, None, None, 1)]


def test_samples_of_other_seeds_are_no_pair() -> None:
    with pytest.raises(ValueError, match="3 values against 2; give those of the same seeds"):
        reductions([([1.0, 2.0, 3.0], [1.0, 2.0])])


def test_the_probability_of_an_event_in_an_hour_is_that_of_its_rate() -> None:
    """Three in five hours; Garwood's interval of 3 is 0.6187 to 8.7673."""
    found = hourly_probability(3, [3600.0] * 5)
    assert found is not None
    assert (found.mean, found.count) == (pytest.approx(1 - math.exp(-3 / 5)), 5)
    assert found.low == pytest.approx(1 - math.exp(-0.618672 / 5), abs=1e-6)
    assert found.high == pytest.approx(1 - math.exp(-8.767273 / 5), abs=1e-6)


def test_without_an_event_the_probability_is_0_up_to_a_bound_that_time_lowers() -> None:
    """No event in T hours bounds the rate by -ln(0.025) / T."""
    for hours in (0.1, 20.0):
        found = hourly_probability(0, [hours * 3600])
        assert found is not None
        assert (found.mean, found.low) == (0.0, 0.0)
        assert math.copysign(1, found.mean) == 1  # a table would show -0.00
        assert found.high == pytest.approx(1 - 0.025 ** (1 / hours))


def test_where_nobody_looked_nothing_is_known_but_what_came_at_once() -> None:
    assert hourly_probability(0, [0.0, 0.0]) is None
    assert hourly_probability(2, [0.0, 0.0]) == Estimate(1.0, None, None, 2)

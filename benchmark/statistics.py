"""Means over seeds with bootstrap intervals, and differences paired by seed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CONFIDENCE = 0.95
RESAMPLES = 5000
ENOUGH = 6  # values: all on one side of zero by chance in 1 of 32 cases; with fewer, more often
RANDOM_STATE = 20240923  # fixed, so that the same records give the same table


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean with its 95 % interval; ``low`` and ``high`` are None for a single value."""

    mean: float
    low: float | None
    high: float | None
    count: int

    @property
    def excludes_zero(self) -> bool:
        """Whether the interval lies on one side of zero, with seeds enough to say so."""
        if self.low is None or self.high is None or self.count < ENOUGH:
            return False
        return self.low > 0 or self.high < 0


def estimates(samples: Sequence[Sequence[float]]) -> list[Estimate]:
    """The mean of each sample with its percentile bootstrap interval.

    Samples of one size are resampled together with the same draws, so that an estimate does not
    depend on which others are asked for.

    Args:
        samples: per sample the values over seeds; sizes may differ, none may be empty.
    """
    found: dict[int, Estimate] = {}
    by_size: dict[int, list[int]] = {}
    for index, sample in enumerate(samples):
        by_size.setdefault(len(sample), []).append(index)
    for size, indices in by_size.items():
        values = np.asarray([samples[index] for index in indices], dtype=float)
        lows, highs = _interval(values)
        for row, index in enumerate(indices):
            mean = float(values[row].mean())
            found[index] = (
                Estimate(mean, float(lows[row]), float(highs[row]), size)
                if size > 1
                else Estimate(mean, None, None, 1)
            )
    return [found[index] for index in range(len(samples))]


def _interval(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds per row of an array of shape (samples, seeds)."""
    if values.shape[1] < 2:
        return values[:, 0], values[:, 0]
    from scipy import stats  # takes a second to import

    result = stats.bootstrap(
        (values,),
        np.mean,
        axis=-1,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",  # BCa is undefined where all seeds agree, as collisions often do
        rng=np.random.default_rng(RANDOM_STATE),
        vectorized=True,
    )
    return result.confidence_interval.low, result.confidence_interval.high

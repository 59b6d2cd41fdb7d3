"""Means over seeds with bootstrap intervals, and differences paired by seed."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

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

    Each sample is resampled by itself, always with the same draws, so that an estimate does not
    depend on which others are asked for.

    Args:
        samples: per sample the values over seeds; sizes may differ, none may be empty.
    """
    return [_estimate(tuple(sample)) for sample in samples]


@lru_cache(maxsize=65536)  # a controller without rates brings the same sample at every rate
def _estimate(values: tuple[float, ...]) -> Estimate:
    mean = float(np.mean(values))
    if len(values) == 1:
        return Estimate(mean, None, None, 1)
    if len(set(values)) == 1:
        return Estimate(mean, mean, mean, len(values))
    from scipy import stats  # takes a second to import

    interval = stats.bootstrap(
        (values,),
        np.mean,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",  # BCa is undefined where all seeds agree, as collisions often do
        rng=np.random.default_rng(RANDOM_STATE),
        vectorized=True,
    ).confidence_interval
    return Estimate(mean, float(interval.low), float(interval.high), len(values))

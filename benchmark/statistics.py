"""Means over seeds with bootstrap intervals, and differences paired by seed."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

CONFIDENCE = 0.95
RESAMPLES = 5000
ENOUGH = 6  # values: all on one side of zero by chance in 1 of 32 cases; with fewer, more often
RANDOM_STATE = 20240923  # fixed, so that the same records give the same table


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean, or a ratio of means, with its 95 % interval; no bounds for a single value."""

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


def reductions(pairs: Sequence[tuple[Sequence[float], Sequence[float]]]) -> list[Estimate | None]:
    """By which share each sample's mean lies below its baseline's: 1 - mean(ours)/mean(baseline).

    Both means are resampled together, so that the interval is that of the ratio paired by seed.

    Args:
        pairs: per comparison our values and the baseline's, in the order of the same seeds.

    Returns:
        Per comparison the share, 0.2 for a fifth less, in ``Estimate.mean``; None without values,
        or where the baseline's are not all above zero and there is nothing to divide by.
    """
    return [_reduction(tuple(ours), tuple(baseline)) for ours, baseline in pairs]


@lru_cache(maxsize=4096)
def _reduction(ours: tuple[float, ...], baseline: tuple[float, ...]) -> Estimate | None:
    if len(ours) != len(baseline):
        raise ValueError(
            f"{len(ours)} values against {len(baseline)}; give those of the same seeds"
        )
    if not ours or min(baseline) <= 0:
        return None
    share = float(_share_below(np.array(ours), np.array(baseline)))
    if len(ours) == 1:
        return Estimate(share, None, None, 1)
    from scipy import stats

    interval = stats.bootstrap(
        (ours, baseline),
        _share_below,
        paired=True,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(RANDOM_STATE),
        vectorized=True,
    ).confidence_interval
    return Estimate(share, float(interval.low), float(interval.high), len(ours))


def _share_below(ours: Values, baseline: Values, axis: int = -1) -> Values:
    share: Values = 1 - np.mean(ours, axis=axis) / np.mean(baseline, axis=axis)
    return share

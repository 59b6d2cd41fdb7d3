"""Means over seeds with bootstrap intervals, and differences paired by seed."""

import math
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from benchmark.plumbing.processes import cores

Values = NDArray[np.float64]

CONFIDENCE = 0.95
RESAMPLES = 5000
ENOUGH = 6  # values: all on one side of zero by chance in 1 of 32 cases; with fewer, more often
CHUNK = 256  # samples whose resamples are in memory at once, 10 MB
RANDOM_STATE = 20240923  # fixed, so that the same records give the same table


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean, or a ratio of means, with its 95 % interval; no bounds for a single value."""

    mean: float
    low: float | None
    high: float | None
    count: int

    @property
    def bounds(self) -> tuple[float, float]:
        """The interval; of a single value, the value itself."""
        if self.low is None or self.high is None:
            return self.mean, self.mean
        return self.low, self.high

    @property
    def excludes_zero(self) -> bool:
        """Whether the interval lies on one side of zero, with seeds enough to say so."""
        if self.low is None or self.high is None or self.count < ENOUGH:
            return False
        return self.low > 0 or self.high < 0


def estimates(samples: Iterable[Sequence[float] | Values]) -> list[Estimate]:
    """The mean of each sample with its percentile bootstrap interval.

    Each sample is resampled by itself, always with the same draws, so that an estimate does not
    depend on which others are asked for.

    Args:
        samples: per sample the values over seeds; sizes may differ, none may be empty.
    """
    given = [np.asarray(sample, dtype=np.float64) for sample in samples]
    keys = [sample.tobytes() for sample in given]  # many are equal: nothing collided, for one
    by_size: dict[int, dict[bytes, Values]] = {}
    for key, sample in zip(keys, given, strict=True):
        by_size.setdefault(len(sample), {}).setdefault(key, sample)
    made: dict[bytes, Estimate] = {}
    for alike in by_size.values():
        made |= zip(alike, _of_one_size(np.stack([*alike.values()])), strict=True)
    return [made[key] for key in keys]


def _of_one_size(samples: Values) -> list[Estimate]:
    """Estimates of samples as rows of a matrix."""
    count = samples.shape[1]
    means = samples.mean(axis=1).tolist()
    if count == 1:
        return [Estimate(mean, None, None, 1) for mean in means]
    varied = np.flatnonzero((samples != samples[:, :1]).any(axis=1))
    made = [Estimate(mean, mean, mean, count) for mean in means]
    bounds = _side_by_side(samples[varied], _times(count)).tolist()
    for index, (low, high) in zip(varied.tolist(), bounds, strict=True):
        made[index] = Estimate(means[index], low, high, count)
    return made


def _side_by_side(samples: Values, times: Values) -> Values:
    """The interval of each row, a chunk of them on each core."""
    parts = [samples[start : start + CHUNK] for start in range(0, len(samples), CHUNK)]
    if len(parts) < 2:
        return _bounds(samples, times)
    from threadpoolctl import threadpool_limits

    # matrices and sorting leave Python's lock alone; threads within threads take thrice as long
    with threadpool_limits(1), ThreadPoolExecutor(cores()) as threads:
        return np.concatenate([*threads.map(lambda part: _bounds(part, times), parts)])


def _times(count: int) -> Values:
    """Per resample how often each value of a sample is drawn."""
    drawn = np.random.default_rng(RANDOM_STATE).integers(0, count, (RESAMPLES, count))
    cells = np.arange(RESAMPLES)[:, None] * count + drawn
    times = np.bincount(cells.ravel(), minlength=RESAMPLES * count)
    return times.reshape(RESAMPLES, count).astype(np.float64)


def _bounds(samples: Values, times: Values) -> Values:
    """The interval of each row: what ``scipy.stats.bootstrap`` finds, for very many at once.

    Values are taken as whole multiples of a small power of two, so small that sums are exact and
    do not depend on the order that this machine's matrix product adds in.
    """
    count = samples.shape[1]
    _, exponents = np.frexp(np.abs(samples).max(axis=1, keepdims=True))
    unit = np.ldexp(1.0, exponents - (52 - count.bit_length()))
    sums = np.rint(samples / unit) @ times.T
    sums.sort(axis=1)
    # percentiles: BCa is undefined where all seeds agree, as collisions often do
    tail = (1 - CONFIDENCE) / 2 * (RESAMPLES - 1)
    below, part = int(tail), tail - int(tail)
    ends = sums[:, [below, -1 - below]] * unit / count
    inner = sums[:, [below + 1, -2 - below]] * unit / count
    bounds: Values = ends * (1 - part) + inner * part
    return bounds


def hourly_probability(events: int, exposures: Sequence[float] | Values) -> Estimate | None:
    """The probability of a first event within an hour, as if it came at a constant rate.

    The rate is events per exposure, its interval the exact one of Garwood (Fiducial Limits for the
    Poisson Distribution, Biometrika 28, 1936).

    Args:
        events: trials in which it came.
        exposures: per trial the time until it came, or until nobody looked any more [s].

    Returns:
        None where there is nothing to tell it from: no exposure and no event.
    """
    from scipy.special import gammaincinv

    total, tail = float(np.sum(exposures)) / 3600, (1 - CONFIDENCE) / 2
    if total <= 0:
        return Estimate(1.0, None, None, len(exposures)) if events else None
    low = float(gammaincinv(events, tail)) if events else 0.0
    high = float(gammaincinv(events + 1, 1 - tail))
    rate, least, greatest = (-math.expm1(-count / total) for count in (float(events), low, high))
    return Estimate(rate, least, greatest, len(exposures))


def reductions(
    pairs: Sequence[tuple[Sequence[float] | Values, Sequence[float] | Values]],
) -> list[Estimate | None]:
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

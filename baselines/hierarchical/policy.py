"""What an RV does under Stop: an acceleration and perhaps a lane change, in numpy."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from threadpoolctl import threadpool_limits

from benchmark.learning.observation import Numbers

RIGHT = float(np.float32(0.33))  # actions are float32
LEFT = -RIGHT
"""Thresholds of the second action: below ``LEFT`` to the left, above ``RIGHT`` to the right."""


class LowLevel(Protocol):
    """Decides for RVs that the top level stopped."""

    def __call__(self, observations: Numbers) -> Numbers:
        """Actions (rows, 2) in [-1, 1], acceleration and lane change, of observations."""
        ...


class Forward:
    """Full acceleration in the own lane: what remains is the safety mechanism."""

    def __call__(self, observations: Numbers) -> Numbers:
        """1 and 0 for each row."""
        return np.tile(np.array([1.0, 0.0], dtype=np.float32), (len(observations), 1))


class Random:
    """Uniform draws: what a learned policy must beat before anything can be said to be learned.

    Args:
        seed: of the draws.
    """

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng(seed)

    def __call__(self, observations: Numbers) -> Numbers:
        """A draw for each row."""
        return self._random.uniform(-1.0, 1.0, (len(observations), 2)).astype(np.float32)


class Learned:
    """The mean action of a Gaussian policy over layers of tanh.

    Args:
        arrays: ``hidden.K.weight``, ``hidden.K.bias``, ``action.weight`` and ``action.bias``.
    """

    def __init__(self, arrays: Mapping[str, Numbers]) -> None:
        self._arrays = arrays
        threadpool_limits(1)  # other bits with other counts
        self._depth = sum(name.startswith("hidden") for name in arrays) // 2

    def means(self, observations: Numbers) -> Numbers:
        """The mean action for each row, not clipped."""
        found = observations
        for index in range(self._depth):
            weight, bias = (self._arrays[f"hidden.{index}.{x}"] for x in ("weight", "bias"))
            found = np.tanh(found @ weight.T + bias)
        action: Numbers = found @ self._arrays["action.weight"].T + self._arrays["action.bias"]
        return action

    def __call__(self, observations: Numbers) -> Numbers:
        """The mean action for each row, clipped to [-1, 1]."""
        return np.clip(self.means(observations), -1.0, 1.0)

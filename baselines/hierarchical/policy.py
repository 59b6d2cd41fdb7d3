"""What RVs under Stop do: accelerations and lane changes, in numpy."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from threadpoolctl import threadpool_limits

from benchmark.control.state import TrafficState, Vehicle
from benchmark.learning.observation import Numbers

RIGHT = float(np.float32(0.33))  # actions are float32
LEFT = -RIGHT
"""Thresholds of the second action: below ``LEFT`` to the left, above ``RIGHT`` to the right."""


class LowLevelObserver(Protocol):
    """Turns traffic into what the low level sees."""

    def observe(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """A row for each ego."""
        ...


class LowLevel(Protocol):
    """Decides for RVs that the top level stopped."""

    def __call__(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """Actions (egos, 2) in [-1, 1]: acceleration and lane change."""
        ...


class Forward:
    """Full acceleration in the own lane: what remains is the safety mechanism."""

    def __call__(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """1 and 0 for each ego."""
        return np.tile(np.array([1.0, 0.0], dtype=np.float32), (len(egos), 1))


class Random:
    """Uniform draws: what a learned policy must beat before anything can be said to be learned.

    Args:
        seed: of the draws.
    """

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng(seed)

    def __call__(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """A draw for each ego."""
        return self._random.uniform(-1.0, 1.0, (len(egos), 2)).astype(np.float32)


class ActionNetwork:
    """Layers of tanh and a linear one: the mean of a Gaussian policy.

    Args:
        arrays: ``hidden.K.weight``, ``hidden.K.bias``, ``action.weight`` and ``action.bias``.
    """

    def __init__(self, arrays: Mapping[str, Numbers]) -> None:
        threadpool_limits(1)  # other bits with other counts
        self._action = arrays["action.weight"], arrays["action.bias"]
        depth = sum(name.startswith("hidden") for name in arrays) // 2
        self._hidden = [
            (arrays[f"hidden.{index}.weight"], arrays[f"hidden.{index}.bias"])
            for index in range(depth)
        ]

    def means(self, observations: Numbers) -> Numbers:
        """The mean action (rows, 2) for each row, not clipped."""
        hidden = observations
        for weight, bias in self._hidden:
            hidden = np.tanh(hidden @ weight.T + bias)
        weight, bias = self._action
        action: Numbers = hidden @ weight.T + bias
        return action


def shapes(size: int, hidden: Sequence[int]) -> dict[str, tuple[int, ...]]:
    """The arrays of a network and their shapes.

    Args:
        size: of an observation.
        hidden: widths of the layers.
    """
    arrays: dict[str, tuple[int, ...]] = {}
    for index, (before, after) in enumerate(zip([size, *hidden], hidden, strict=False)):
        arrays |= {f"hidden.{index}.weight": (after, before), f"hidden.{index}.bias": (after,)}
    return arrays | {"action.weight": (2, hidden[-1]), "action.bias": (2,)}


class Learned:
    """The mean action, clipped.

    Args:
        arrays: of the network.
        observer: of what it sees.
    """

    def __init__(self, arrays: Mapping[str, Numbers], observer: LowLevelObserver) -> None:
        self._network, self._observer = ActionNetwork(arrays), observer

    def __call__(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        """The mean action for each ego, clipped to [-1, 1]."""
        means = self._network.means(self._observer.observe(state, egos))
        return np.clip(means, -1.0, 1.0)

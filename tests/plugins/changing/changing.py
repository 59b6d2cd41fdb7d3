"""A controller whose source tests change, as its author would between two runs of a check."""

import ctypes

from baselines.virtual_signal import VirtualSignal
from benchmark.control.intersection import Intersection

CLEARANCE = 2.0  # s
NOISE = 0.0  # s, added on odd seeds and taken away on even ones
CRASHES_ON = ()  # seeds


class Changing(VirtualSignal):
    """RVs act as a signal, until somebody edits this file."""

    def reset(self, intersection: Intersection, seed: int) -> None:
        if seed in CRASHES_ON:
            ctypes.string_at(0)
        self._clearance = CLEARANCE + (NOISE if seed % 2 else -NOISE)
        super().reset(intersection, seed)

"""Ctrl-C as a wish to stop soon, and once more to stop at once."""

import signal
from collections.abc import Callable
from types import FrameType
from typing import Self


class Interrupts:
    """Turns the first Ctrl-C into a wish to stop; a context manager. The second stops at once.

    Args:
        wish: called on the first, in the middle of whatever runs.
    """

    def __init__(self, wish: Callable[[], None]) -> None:
        self.wanted = False
        self._wish = wish

    def __enter__(self) -> Self:
        self._before = signal.signal(signal.SIGINT, self._hear)
        return self

    def __exit__(self, *error: object) -> None:
        signal.signal(signal.SIGINT, self._before)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        if self.wanted:
            raise KeyboardInterrupt
        self.wanted = True
        self._wish()

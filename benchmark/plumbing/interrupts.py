"""Ctrl-C as a wish to stop soon, and once more to stop at once."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Self


class Interrupts:
    """Turns the first Ctrl-C into a wish to stop; a context manager. The second stops at once.

    Args:
        wish: called on the first, in the middle of whatever runs.
    """

    def __init__(self, wish: Callable[[], None]) -> None:
        self.wanted = self._held = self._missed = False
        self._wish = wish

    def __enter__(self) -> Self:
        self._before = signal.signal(signal.SIGINT, self._hear)
        return self

    def __exit__(self, *error: object) -> None:
        signal.signal(signal.SIGINT, self._before)

    @contextmanager
    def held_back(self) -> Iterator[None]:
        """Let what is done here come to its end before a second Ctrl-C stops everything."""
        self._held, self._missed = True, False
        try:
            yield
        finally:
            self._held = False
        if self._missed:
            raise KeyboardInterrupt

    def _hear(self, number: int, frame: FrameType | None) -> None:
        if self.wanted and self._held:
            self._missed = True
        elif self.wanted:
            raise KeyboardInterrupt
        else:
            self.wanted = True
            self._wish()

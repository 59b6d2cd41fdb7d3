"""Processes that a test waits for and ends."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

PATIENCE = 60.0  # s for what takes a second where nothing else runs


def kill(pid: int) -> None:
    os.kill(pid, signal.SIGKILL)


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def pid_in(marker: Path) -> int:
    """The process that has come to this marker, and stays there."""
    wait_for(lambda: marker.exists() and bool(marker.read_text()))
    return int(marker.read_text())

"""What a process gives up before it runs code that nobody vouches for."""

import ctypes
import os
import signal
import sys
from collections.abc import Iterable, Iterator

from benchmark.control.isolation import landlock, seccomp

OPEN_FILES = 256
SET_PARENT_DEATH_SIGNAL = 1  # of prctl


def enter(readable: Iterable[str], memory: int, runner: int) -> None:
    """Limit and confine this process, for ever, and let it die with its runner.

    Args:
        readable: files and folders that it may go on reading.
        memory: its address space [MB].
        runner: the process that started it.

    Raises:
        OSError: the system refuses.
    """
    _limit(memory)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
        if os.getppid() != runner:  # it died before
            os._exit(0)
    if landlock.version():
        landlock.restrict(readable)
    if seccomp.available():
        seccomp.restrict()


def _limit(memory: int) -> None:
    import resource

    for kind, most in (
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, 0),  # no file can grow: nothing fills the disk
        (resource.RLIMIT_NOFILE, OPEN_FILES),
        (resource.RLIMIT_AS, memory * 1_000_000),
    ):
        hard = resource.getrlimit(kind)[1]
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (most, most))


def missing() -> Iterator[str]:
    """What this system cannot keep from an isolated controller, in words."""
    if not landlock.version():
        yield "read and change your files (no Landlock; Linux has it from 5.13 on)"
    if not seccomp.available():
        yield "start and signal processes and use the network (no seccomp filter for this system)"

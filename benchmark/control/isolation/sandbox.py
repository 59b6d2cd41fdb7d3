"""What a process gives up before it runs code that nobody vouches for."""

import ctypes
import os
import signal
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmark.control.isolation import landlock, namespace, privileges, seccomp

OPEN_FILES = 256
SET_PARENT_DEATH_SIGNAL = 1  # of prctl


@dataclass(frozen=True)
class Place:
    """The files that are left."""

    readable: tuple[str, ...]  # files and folders
    listed: tuple[str, ...]  # folders whose entries are shown
    temporary: Path  # an empty folder; nothing is written where the system has no private one


def enter(place: Place, memory: int, runner: int) -> None:
    """Limit and confine this process, for ever, and let it die with its runner.

    Args:
        place: the files that it goes on seeing.
        memory: its address space [MB].
        runner: the process that started it.

    Raises:
        OSError: the system refuses.
    """
    if os.getppid() != runner:  # it died before
        os._exit(0)
    has_room = namespace.enter(place.readable, place.temporary)
    tempfile.tempdir = str(
        place.temporary
    )  # not tried out: libraries ask for one that they never use
    _limit(memory, namespace.ROOM if has_room else 0)
    privileges.drop()
    if sys.platform == "linux":  # after all that changes what this process may do
        ctypes.CDLL(None).prctl(SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
        if os.getppid() != runner:
            os._exit(0)
    if landlock.version():
        writable = (str(place.temporary),) if has_room else ()
        landlock.restrict(place.readable, place.listed, writable)
    if seccomp.available():
        seccomp.restrict()


def _limit(memory: int, room: int) -> None:
    import resource

    for kind, most in (
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, room * 1_000_000),
        (resource.RLIMIT_NOFILE, OPEN_FILES),
        (resource.RLIMIT_AS, memory * 1_000_000),
    ):
        hard = resource.getrlimit(kind)[1]
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (most, most))


def missing() -> Iterator[str]:
    """What this system cannot keep from an isolated controller, in words."""
    hidden = namespace.available()
    if not (landlock.version() or hidden):
        yield (
            "read and change your files (no Landlock, which Linux has from 5.13 on, and no "
            "namespaces)"
        )
    if not seccomp.available():
        yield "start and signal processes and use the network (no seccomp filter for this system)"
    if not hidden:
        yield (
            "see which paths exist, how large files are and when they changed, and has no "
            "temporary folder (neither root nor user namespaces)"
        )
    if sys.platform != "linux" and hasattr(os, "geteuid") and os.geteuid() == 0:
        yield "do what root may do (capabilities are given up on Linux only); use another user"

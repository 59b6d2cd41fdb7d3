"""Linux: a process sees a root folder of its own, of what it may read and a folder in memory.

Needs root, or a system on which users may make user namespaces; elsewhere all stays as it is. What
is not in that root is not there: no path says whether it exists, its size or when it changed.
"""

import ctypes
import os
import struct
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path

NEW_MOUNTS, NEW_USER = 0x20000, 0x10000000  # of unshare
BIND, RECURSIVE, PRIVATE, DETACH = 0x1000, 0x4000, 0x40000, 2  # of mount and umount2
NO_SUID, NO_DEVICES, NO_PROGRAMS = 2, 4, 8  # the same
PIVOT_ROOT = {"x86_64": 155, "aarch64": 41}  # system calls
SET_ATTRIBUTES, BENEATH, HERE = 442, 0x8000, -100  # one more, and its flags
READ_ONLY, NEVER_SUID, NO_ACCESS_TIMES, ANY_ACCESS_TIMES = 1, 2, 0x10, 0x70  # attributes
ROOM = 64  # MB of temporary files
MOST_FILES = 4096


def enter(readable: Iterable[str], temporary: Path) -> bool:
    """Move into a root of these files and folders, which cannot be changed.

    Args:
        readable: what is there; paths stay as they are.
        temporary: an empty folder; becomes one in memory, bounded, which ends with this process.

    Returns:
        Whether the system let it; if not, everything is where it was.
    """
    machine = os.uname().machine
    if sys.platform != "linux" or machine not in PIVOT_ROOT:
        return False
    mounts = Mounts()
    try:
        _separate(mounts)
        mounts.mount("none", "/", None, RECURSIVE | PRIVATE)
        _build(mounts, readable, temporary)
        mounts.pivot(PIVOT_ROOT[machine], str(temporary))
    except OSError:
        return False
    return True


class Mounts:
    """The system's calls; each raises OSError."""

    def __init__(self) -> None:
        self._libc = ctypes.CDLL(None, use_errno=True)
        self._libc.syscall.restype = ctypes.c_long

    def separate(self, flags: int) -> None:
        """Unshare namespaces."""
        self._check(self._libc.unshare(ctypes.c_int(flags)))

    def mount(self, source: str, target: str, kind: str | None, flags: int, data: str = "") -> None:
        """Mount a file system, or a folder or file a second time."""
        names = [os.fsencode(text) if text else None for text in (source, target, kind)]
        self._check(self._libc.mount(*names, ctypes.c_ulong(flags), data.encode()))

    def freeze(self, root: str) -> None:
        """From here on nothing beneath changes, and if possible no reading leaves its time."""
        times = (READ_ONLY | NEVER_SUID | NO_ACCESS_TIMES, ANY_ACCESS_TIMES)
        try:
            self._set(root, *times)
        except OSError:  # these belong to whoever made the mount
            self._set(root, READ_ONLY | NEVER_SUID, 0)

    def pivot(self, number: int, root: str) -> None:
        """Make a folder the root, and forget the other one."""
        os.chdir(root)
        self._check(self._libc.syscall(ctypes.c_long(number), b".", b"."))
        self._check(self._libc.umount2(b".", DETACH))
        os.chdir("/")

    def _set(self, root: str, on: int, off: int) -> None:
        attributes = struct.pack("4Q", on, off, 0, 0)
        head = ctypes.c_long(SET_ATTRIBUTES), ctypes.c_int(HERE), os.fsencode(root)
        size = ctypes.c_size_t(len(attributes))
        self._check(self._libc.syscall(*head, ctypes.c_uint(BENEATH), attributes, size))

    def _check(self, result: int) -> None:
        if result:
            raise OSError(ctypes.get_errno(), "no mounts of one's own here")


def _separate(mounts: Mounts) -> None:
    user, group = os.geteuid(), os.getegid()
    try:
        mounts.separate(NEW_MOUNTS)
    except OSError:  # not root
        mounts.separate(NEW_MOUNTS | NEW_USER)
        for name, text in (
            ("setgroups", "deny"),
            ("uid_map", f"{user} {user} 1"),
            ("gid_map", f"{group} {group} 1"),
        ):
            Path("/proc/self", name).write_text(text, encoding="ascii")


def _build(mounts: Mounts, readable: Iterable[str], temporary: Path) -> None:
    root = str(temporary)
    mounts.mount("tmpfs", root, "tmpfs", NO_SUID | NO_DEVICES, "size=1m,mode=755")
    bound: list[Path] = []
    for path in sorted({Path(path) for path in (*readable, os.devnull)}):
        if not path.exists() or any(other in path.parents for other in bound):
            continue
        target = Path(root + str(path))
        _prepare(target, path.is_dir())
        mounts.mount(str(path), str(target), None, BIND | RECURSIVE)
        bound.append(path)
    inner = Path(root + root)
    _prepare(inner, True)
    mounts.freeze(root)
    room = f"size={ROOM}m,nr_inodes={MOST_FILES},mode=700"
    mounts.mount("tmpfs", str(inner), "tmpfs", NO_SUID | NO_DEVICES | NO_PROGRAMS, room)


def _prepare(target: Path, is_folder: bool) -> None:
    if is_folder:
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    target.touch()


@cache
def available() -> bool:
    """Whether this system lets this user have a root of one's own, tried in a process."""
    if not hasattr(os, "fork"):
        return False
    import subprocess
    import tempfile

    code = (
        "import sys; from pathlib import Path; from benchmark.control.isolation import namespace; "
        "sys.path[:] = []; sys.exit(not namespace.enter((), Path(sys.argv[1])))"
    )
    with suppress(OSError), tempfile.TemporaryDirectory(prefix="rightofway-isolated-") as folder:
        package = str(Path(__file__).parents[3])
        done = subprocess.run(  # noqa: S603  (this Python, a list of arguments)
            [sys.executable, "-B", "-c", code, folder], cwd=package, timeout=60, check=False
        )
        return done.returncode == 0
    return False

"""What an isolated controller might try, each tried for real where it does no harm if it succeeds.

A call gets arguments that change nothing: a priority that is the present one, a signal that is
none, an order that the kernel does not know. Whoever may make it is not refused.
"""

import contextlib
import ctypes
import errno
import fcntl
import os
import platform
import resource
import socket
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

REFUSALS = frozenset({errno.EPERM, errno.EACCES, errno.EROFS, errno.ENOENT, errno.ENOSYS})
THROUGH = "got through"
NUMBERS = {  # of system calls without a function in the C library
    "x86_64": {"bpf": 321, "perf_event_open": 298, "keyctl": 250, "ioprio_set": 251},
    "aarch64": {"bpf": 280, "perf_event_open": 241, "keyctl": 219, "ioprio_set": 30},
}
F_SETSIG = 10  # of fcntl
PIDFD_OPEN, IO_URING_SETUP, CLONE3 = 434, 425, 435
FILE_LIMIT = 300_000_000  # bytes, more than any temporary folder has

Attempt = Callable[[Path], object]


@dataclass(frozen=True)
class Protection:
    """What is kept out, what the system needs for it, and what would get through without."""

    name: str
    needs: str
    attempts: Mapping[str, Attempt]  # with a file and a folder that are not the controller's


def tried(victim: Path) -> dict[str, str]:
    """What came of each attempt: the name of an error, or ``THROUGH``.

    Args:
        victim: a file of the user's that the controller was not given.
    """
    return {
        f"{protection.name}: {name}": _outcome(attempt, victim)
        for protection in PROTECTIONS
        for name, attempt in protection.attempts.items()
    }


def _outcome(attempt: Attempt, victim: Path) -> str:
    try:
        attempt(victim)
    except OSError as error:
        if error.errno in REFUSALS:
            return errno.errorcode[error.errno]
    except (ValueError, subprocess.SubprocessError) as error:  # as ``setrlimit`` refuses
        return type(error).__name__
    return THROUGH


def _c(function: str, *given: object) -> None:
    """Call the C library.

    Raises:
        OSError: what it says.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, function):
        raise OSError(errno.ENOSYS, function)
    libc[function].restype = ctypes.c_long
    values = [ctypes.c_long(one) if isinstance(one, int) else one for one in given]
    if libc[function](*values) in (-1, 2**32 - 1):  # as 64 bits some are not extended
        raise OSError(ctypes.get_errno(), function)


def _call(number: int | str, *given: object) -> None:
    """Make a system call."""
    if isinstance(number, str):
        numbers = NUMBERS.get(platform.machine(), {})
        if number not in numbers:
            raise OSError(errno.ENOSYS, number)
        number = numbers[number]
    _c("syscall", number, *given)


def _fork(_: Path) -> None:
    if os.fork() == 0:
        os._exit(0)
    os.wait()


def _own_a_file(command: int, value: int) -> None:
    """Ask that somebody gets signals of the socket to the runner, and take it back."""
    line = next(number for number in range(3, 256) if _is_open(number))
    fcntl.fcntl(line, command, value)
    fcntl.fcntl(line, command, 0)


def _is_open(number: int) -> bool:
    with contextlib.suppress(OSError):
        os.fstat(number)
        return True
    return False


def _set_affinity(_: Path) -> None:
    os.sched_setaffinity(os.getppid(), os.sched_getaffinity(os.getppid()))


def _set_scheduler(_: Path) -> None:
    os.sched_setscheduler(os.getppid(), os.SCHED_OTHER, os.sched_param(0))


def _set_priority(_: Path) -> None:
    os.setpriority(os.PRIO_PROCESS, os.getppid(), os.nice(0))


def _fill(_: Path) -> None:
    """Write more than a temporary folder may hold."""
    path = Path(tempfile.gettempdir(), "filling")
    try:
        with path.open("wb") as file:
            for size in [10_000_000] * (FILE_LIMIT // 10_000_000):
                file.write(bytes(size))
    except OSError as error:
        raise OSError(errno.EPERM, "full") from error
    finally:
        with contextlib.suppress(OSError):
            path.unlink()


def _leave_a_file(_: Path) -> None:
    Path("left").write_text("")
    Path("left").unlink()


def _have_capabilities(_: Path) -> None:
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    sets = {
        name: int(value, 16)
        for name, _, value in (line.partition(":") for line in lines)
        if name in ("CapEff", "CapPrm", "CapInh", "CapAmb")
    }
    if not any(sets.values()):
        raise PermissionError(errno.EPERM, "none")


def _raise_a_limit(_: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.prlimit(0, resource.RLIMIT_NOFILE, (soft, hard))


SECCOMP = "seccomp filter (x86-64 or 64-bit ARM, Linux 3.19)"
FILES = "Landlock (Linux 5.13), or a mount namespace (Linux 5.12; root or user namespaces)"
NAMESPACE = "a mount namespace (Linux 5.12; root or user namespaces)"

PROTECTIONS = (
    Protection(
        "your files",
        FILES,
        {
            "read": lambda victim: victim.read_bytes(),
            "list a folder": lambda victim: list(victim.parent.iterdir()),
            "overwrite": lambda victim: victim.open("ab").close(),
            "create": lambda victim: (victim.parent / "new").open("ab").close(),
            "delete": lambda victim: (victim.parent / "spare").unlink(),
            "rename": lambda victim: victim.rename(victim),
            "make a folder": lambda victim: (victim.parent / "folder").mkdir(),
            "write into the working folder": _leave_a_file,
        },
    ),
    Protection(
        "modes, owners, times of your files",
        SECCOMP,
        {
            "chmod": lambda victim: victim.chmod(0o600),
            "chown": lambda victim: os.chown(victim, -1, -1),
            "utime": os.utime,
            "setxattr": lambda victim: os.setxattr(victim, "user.rightofway", b""),
            "link": lambda victim: os.link(victim, victim.parent / "linked"),
            "symlink": lambda victim: (victim.parent / "pointer").symlink_to(victim),
        },
    ),
    Protection(
        "whether a path exists, its size and times",
        NAMESPACE,
        {"stat": os.stat, "readlink": lambda victim: (victim.parent / "alias").readlink()},
    ),
    Protection(
        "notices of what changes",
        SECCOMP,
        {
            "inotify": lambda _: _c("inotify_init"),
            "fanotify": lambda _: _c("fanotify_init", 0x200, 0),
        },
    ),
    Protection(
        "other processes started",
        SECCOMP,
        {
            "fork": _fork,
            "clone3": lambda _: _call(CLONE3, None, 0),
            "execve": lambda _: _c("execve", None, None, None),
        },
    ),
    Protection(
        "the runner signalled",
        SECCOMP,
        {
            "kill": lambda _: os.kill(os.getppid(), 0),
            "tgkill": lambda _: _c("tgkill", os.getppid(), os.getppid(), 0),
            "pidfd": lambda _: _call(PIDFD_OPEN, os.getppid(), 0),
            "F_SETOWN": lambda _: _own_a_file(fcntl.F_SETOWN, os.getppid()),
            "F_SETSIG": lambda _: _own_a_file(F_SETSIG, 0),
            "ptrace": lambda _: _c("ptrace", 9999, os.getppid(), None, None),
            "process_vm_readv": lambda _: _c("process_vm_readv", os.getppid(), None, 0, None, 0, 0),
        },
    ),
    Protection(
        "the runner slowed down",
        SECCOMP,
        {
            "affinity": _set_affinity,
            "scheduler": _set_scheduler,
            "priority": _set_priority,
            "ioprio": lambda _: _call("ioprio_set", 1, os.getppid(), 0),
            "prlimit": lambda _: resource.prlimit(os.getppid(), resource.RLIMIT_CORE),
        },
    ),
    Protection(
        "the network",
        SECCOMP,
        {
            "internet": lambda _: socket.socket(socket.AF_INET).close(),
            "local socket": lambda _: socket.socket(socket.AF_UNIX).close(),
            "packets": lambda _: socket.socket(socket.AF_INET6, socket.SOCK_DGRAM).close(),
        },
    ),
    Protection(
        "memory from one episode to the next",
        SECCOMP,
        {
            "keyring": lambda _: _call("keyctl", 0, -4, 0),
            "shared memory": lambda _: _c("shmget", 0, 4096, 0o600),
            "semaphores": lambda _: _c("semget", 0, 1, 0o600),
            "message queues": lambda _: _c("msgget", 0, 0o600),
            "file in memory": lambda _: os.close(os.memfd_create("x")),
            "file lock": lambda _: fcntl.flock(os.open(__file__, os.O_RDONLY), fcntl.LOCK_SH),
        },
    ),
    Protection(
        "the system",
        SECCOMP,
        {
            "bpf": lambda _: _call("bpf", 9999, None, 0),
            "perf_event_open": lambda _: _call("perf_event_open", None, 0, -1, -1, 0),
            "io_uring": lambda _: _call(IO_URING_SETUP, 0, None),
            "reboot": lambda _: _c("reboot", 1),
            "sethostname": lambda _: _c("sethostname", None, 1),
            "chroot": lambda _: os.chroot("/"),
            "acct": lambda _: _c("acct", b"x" * 5000),
            "syslog": lambda _: _c("klogctl", 10, None, 0),
            "mount": lambda _: _c("mount", None, None, None, 0, None),
            "unshare": lambda _: _c("unshare", 0),
            "setns": lambda _: _c("setns", -1, 0),
        },
    ),
    Protection("root's capabilities", "Linux", {"have any": _have_capabilities}),
    Protection(
        "higher limits, and outliving the runner",
        SECCOMP,
        {
            "prlimit": _raise_a_limit,
            "PR_SET_PDEATHSIG": lambda _: _c("prctl", 1, 9, 0, 0, 0),
        },
    ),
    Protection("a disk filled by temporary files", "Linux", {"300 MB": _fill}),
)

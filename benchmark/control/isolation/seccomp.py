"""Linux: a list of system calls, all others refused, that a process puts on itself for ever.

``syscalls`` lists the calls. Of some the arguments count: no process but a thread can be started,
no signal sent elsewhere, no limit raised, and no open file told to signal somebody.
"""

import ctypes
import errno
import os
import platform
import struct
import sys
from collections.abc import Iterator, Sequence

from benchmark.control.isolation import syscalls

SET_NO_NEW_PRIVILEGES, SET_SECCOMP, MODE_FILTER = 38, 22, 2  # of prctl
LOAD, EQUAL, AT_LEAST, ANY_BIT, RETURN = 0x20, 0x15, 0x35, 0x45, 0x06  # of BPF
ALLOW, REFUSE = 0x7FFF0000, 0x00050000  # results; REFUSE + errno
NUMBER, MACHINE, ARGUMENTS = 0, 4, 16  # offsets in what a filter sees; an argument has 8 bytes
FOREIGN_NUMBERS = 0x40000000  # x86-64: from here on they belong to the x32 interface
MACHINES = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}

CLONE_THREAD, NEW_NAMESPACES = 0x10000, 0x7E020000
FILE_COMMANDS = (
    0,
    1,
    2,
    3,
    4,
    1030,
)  # F_DUPFD, F_GETFD, F_SETFD, F_GETFL, F_SETFL, F_DUPFD_CLOEXEC
DEVICE_COMMANDS = (0x5401, 0x5413, 0x541B, 0x5421, 0x5450, 0x5451)
"""TCGETS, TIOCGWINSZ, FIONREAD, FIONBIO, FIONCLEX, FIOCLEX."""
PROCESS_COMMANDS = (3, 15, 16, 0x53564D41)
"""PR_GET_DUMPABLE, PR_SET_NAME, PR_GET_NAME, PR_SET_VMA: the process's and its threads' names."""

Line = tuple[int, int, int, int]
DENIED: Line = (RETURN, 0, 0, REFUSE + errno.EPERM)
MISSING: Line = (RETURN, 0, 0, REFUSE + errno.ENOSYS)
ALLOWED: Line = (RETURN, 0, 0, ALLOW)


def available() -> bool:
    """Whether this module knows the system."""
    return sys.platform == "linux" and platform.machine() in MACHINES


def restrict() -> None:
    """Put the filter on this process and all its threads to come.

    Raises:
        OSError: the kernel refuses.
    """
    code = _program(platform.machine(), os.getpid())
    filters = ctypes.create_string_buffer(code, len(code))
    program = struct.pack("HP", len(code) // 8, ctypes.addressof(filters))
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]
    holder = ctypes.create_string_buffer(program, len(program))
    for call in (
        (SET_NO_NEW_PRIVILEGES, 1, 0, 0, 0),
        (SET_SECCOMP, MODE_FILTER, ctypes.addressof(holder), 0, 0),
    ):
        if libc.prctl(*call):
            raise OSError(ctypes.get_errno(), "seccomp refused")


def _program(machine: str, process: int) -> bytes:
    """The filter's instructions; each block tests one call and falls through to the next."""
    lines = [
        (LOAD, 0, 0, MACHINE),
        (EQUAL, 1, 0, MACHINES[machine]),
        DENIED,
        (LOAD, 0, 0, NUMBER),
        (AT_LEAST, 0, 1, FOREIGN_NUMBERS),
        DENIED,
    ]
    for call in syscalls.ALLOWED.values():
        lines += _block(getattr(call, machine), [ALLOWED])
    for call in syscalls.ABSENT.values():
        lines += _block(getattr(call, machine), [MISSING])
    for name, test in _tests(process).items():
        lines += _block(getattr(syscalls.BOUNDED[name], machine), test)
    return b"".join(struct.pack("HBBI", *line) for line in (*lines, DENIED))


def _block(number: int | None, test: Sequence[Line]) -> Iterator[Line]:
    """What to do if this is the call; a test ends in a result whatever the arguments are."""
    if number is not None:
        yield (EQUAL, 0, len(test), number)
        yield from test


def _tests(process: int) -> dict[str, list[Line]]:
    """By call, what its arguments may be."""
    return {
        "fcntl": _one_of(1, FILE_COMMANDS),
        "ioctl": _one_of(1, DEVICE_COMMANDS),
        "prctl": _one_of(0, PROCESS_COMMANDS),
        "kill": _one_of(0, (process,)),
        "tgkill": _one_of(0, (process,)),
        "sched_setaffinity": _one_of(0, (0,)),  # the thread that asks
        "prlimit64": [  # its own limits, and no new ones: a null pointer only asks
            *_only(0, (0, process)),
            *_only(2, (0,)),
            *_only(2, (0,), half=4),
            ALLOWED,
        ],
        "clone": [
            (LOAD, 0, 0, ARGUMENTS),
            (ANY_BIT, 1, 0, CLONE_THREAD),
            DENIED,
            (ANY_BIT, 0, 1, NEW_NAMESPACES),
            DENIED,
            ALLOWED,
        ],
    }


def _one_of(argument: int, values: Sequence[int]) -> list[Line]:
    return [*_only(argument, values), ALLOWED]


def _only(argument: int, values: Sequence[int], half: int = 0) -> Iterator[Line]:
    """Refuse all but these values of an argument's lower half, which the kernel looks at alone."""
    yield (LOAD, 0, 0, ARGUMENTS + 8 * argument + half)
    for place, value in enumerate(values, 1):
        yield (EQUAL, len(values) - place + 1, 0, value)
    yield DENIED

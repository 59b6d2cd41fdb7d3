"""Linux: a filter on system calls that a process puts on itself and can never take off.

It takes away what reaches other processes: to start, trace or signal one, sockets, shared memory
that outlives the process; and to raise one's own limits or outlive one's parent. All else stays.
"""

import ctypes
import errno
import os
import platform
import struct
import sys

SET_NO_NEW_PRIVILEGES, SET_SECCOMP, MODE_FILTER = 38, 22, 2  # of prctl
SET_PARENT_DEATH_SIGNAL = 1  # the same
LOAD, EQUAL, AT_LEAST, ANY_BIT, RETURN = 0x20, 0x15, 0x35, 0x45, 0x06  # of BPF
ALLOW, REFUSE = 0x7FFF0000, 0x00050000  # results; REFUSE + errno
NUMBER, MACHINE, ARGUMENTS = 0, 4, 16  # offsets in what a filter sees; an argument has 8 bytes
FOREIGN_NUMBERS = 0x40000000  # x86-64: from here on they belong to the x32 interface
CLONE_THREAD = 0x10000

MACHINES = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
REFUSED = {
    "x86_64": {
        *(57, 58, 59, 322),  # fork, vfork, execve, execveat
        *(101, 310, 311),  # ptrace, process_vm_readv, process_vm_writev
        *(200, 129, 297, 424, 434, 438),  # tkill, rt_sigqueueinfo, and through pidfds
        *(41, 425),  # socket, io_uring_setup
        *(29, 64, 68, 240),  # shmget, semget, msgget, mq_open
        *(160, 272, 308),  # setrlimit, unshare, setns
    },
    "aarch64": {
        *(221, 281),
        *(117, 270, 271),
        *(130, 138, 240, 424, 434, 438),
        *(198, 425),
        *(194, 190, 186, 180),
        *(164, 97, 268),
    },
}
CLONE3 = 435
CLONE = {"x86_64": 56, "aarch64": 220}
SIGNAL = {"x86_64": (62, 234), "aarch64": (129, 131)}  # kill, tgkill
PRLIMIT = {"x86_64": 302, "aarch64": 261}
PRCTL = {"x86_64": 157, "aarch64": 167}


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
    denied = (RETURN, 0, 0, REFUSE + errno.EPERM)
    allowed = (RETURN, 0, 0, ALLOW)
    lines = [
        (LOAD, 0, 0, MACHINE),
        (EQUAL, 1, 0, MACHINES[machine]),
        denied,
        (LOAD, 0, 0, NUMBER),
        (AT_LEAST, 0, 1, FOREIGN_NUMBERS),
        denied,
    ]
    for number in sorted(REFUSED[machine]):
        lines += [(EQUAL, 0, 1, number), denied]
    # glibc falls back to clone, whose flags can be seen
    lines += [(EQUAL, 0, 1, CLONE3), (RETURN, 0, 0, REFUSE + errno.ENOSYS)]
    lines += [
        (EQUAL, 0, 4, CLONE[machine]),
        (LOAD, 0, 0, ARGUMENTS),
        (ANY_BIT, 1, 0, CLONE_THREAD),
        denied,
        allowed,
    ]
    for number in SIGNAL[machine]:
        lines += [
            (EQUAL, 0, 4, number),
            (LOAD, 0, 0, ARGUMENTS),
            (EQUAL, 1, 0, process),
            denied,
            allowed,
        ]
    lines += [
        (EQUAL, 0, 4, PRCTL[machine]),
        (LOAD, 0, 0, ARGUMENTS),
        (EQUAL, 0, 1, SET_PARENT_DEATH_SIGNAL),
        denied,
        allowed,
    ]
    new_limit = ARGUMENTS + 2 * 8  # a null pointer only asks
    lines += [
        (EQUAL, 0, 6, PRLIMIT[machine]),
        (LOAD, 0, 0, new_limit),
        (EQUAL, 0, 2, 0),
        (LOAD, 0, 0, new_limit + 4),
        (EQUAL, 1, 0, 0),
        denied,
        allowed,
    ]
    return b"".join(struct.pack("HBBI", *line) for line in (*lines, allowed))

"""The system calls that an isolated controller may make, by their numbers on each machine.

Found by tracing controllers: those shipped, the template, and some with numpy, scipy, polars,
torch, Stable-Baselines3 and ONNX Runtime; then rounded to calls of the same kind.
Source of the numbers: Linux, ``arch/x86/entry/syscalls/syscall_64.tbl`` and
``include/uapi/asm-generic/unistd.h``, which 64-bit ARM uses.
"""

from typing import NamedTuple


class Number(NamedTuple):
    """Of one call, by machine; None: there is no such call."""

    x86_64: int
    aarch64: int | None


ALLOWED = {
    # files that are open
    "read": Number(0, 63),
    "readv": Number(19, 65),
    "pread64": Number(17, 67),
    "preadv": Number(295, 69),
    "write": Number(1, 64),
    "writev": Number(20, 66),
    "pwrite64": Number(18, 68),
    "pwritev": Number(296, 70),
    "lseek": Number(8, 62),
    "close": Number(3, 57),
    "close_range": Number(436, 436),
    "dup": Number(32, 23),
    "dup2": Number(33, None),
    "dup3": Number(292, 24),
    "fstat": Number(5, 80),
    "ftruncate": Number(77, 46),
    "fsync": Number(74, 82),
    "fdatasync": Number(75, 83),
    "fadvise64": Number(221, 223),
    "getdents64": Number(217, 61),
    # paths, which Landlock and the mount namespace hold
    "open": Number(2, None),
    "openat": Number(257, 56),
    "stat": Number(4, None),
    "lstat": Number(6, None),
    "newfstatat": Number(262, 79),
    "statx": Number(332, 291),
    "access": Number(21, None),
    "faccessat": Number(269, 48),
    "faccessat2": Number(439, 439),
    "readlink": Number(89, None),
    "readlinkat": Number(267, 78),
    "getcwd": Number(79, 17),
    "chdir": Number(80, 49),
    "fchdir": Number(81, 50),
    "mkdir": Number(83, None),
    "mkdirat": Number(258, 34),
    "rmdir": Number(84, None),
    "unlink": Number(87, None),
    "unlinkat": Number(263, 35),
    "rename": Number(82, None),
    "renameat": Number(264, 38),
    "renameat2": Number(316, 276),
    "umask": Number(95, 166),
    # memory
    "brk": Number(12, 214),
    "mmap": Number(9, 222),
    "munmap": Number(11, 215),
    "mprotect": Number(10, 226),
    "mremap": Number(25, 216),
    "madvise": Number(28, 233),
    "msync": Number(26, 227),
    "mbind": Number(237, 235),
    "get_mempolicy": Number(239, 236),
    "membarrier": Number(324, 283),
    # threads and this process
    "futex": Number(202, 98),
    "rseq": Number(334, 293),
    "set_robust_list": Number(273, 99),
    "get_robust_list": Number(274, 100),
    "set_tid_address": Number(218, 96),
    "gettid": Number(186, 178),
    "getpid": Number(39, 172),
    "getppid": Number(110, 173),
    "exit": Number(60, 93),
    "exit_group": Number(231, 94),
    "sched_yield": Number(24, 124),
    "restart_syscall": Number(219, 128),
    "arch_prctl": Number(158, None),
    "getuid": Number(102, 174),
    "geteuid": Number(107, 175),
    "getgid": Number(104, 176),
    "getegid": Number(108, 177),
    "getrusage": Number(98, 165),
    "getrlimit": Number(97, 163),
    "getcpu": Number(309, 168),
    "sched_getaffinity": Number(204, 123),
    "sched_getparam": Number(143, 121),
    "sched_getscheduler": Number(145, 120),
    "sched_get_priority_max": Number(146, 125),
    "sched_get_priority_min": Number(147, 126),
    # its signals
    "rt_sigaction": Number(13, 134),
    "rt_sigprocmask": Number(14, 135),
    "rt_sigreturn": Number(15, 139),
    "rt_sigpending": Number(127, 136),
    "rt_sigtimedwait": Number(128, 137),
    "rt_sigsuspend": Number(130, 133),
    "sigaltstack": Number(131, 132),
    # time and waiting
    "nanosleep": Number(35, 101),
    "clock_nanosleep": Number(230, 115),
    "clock_gettime": Number(228, 113),
    "clock_getres": Number(229, 114),
    "gettimeofday": Number(96, 169),
    "time": Number(201, None),
    "times": Number(100, 153),
    "select": Number(23, None),
    "pselect6": Number(270, 72),
    "poll": Number(7, None),
    "ppoll": Number(271, 73),
    "epoll_create1": Number(291, 20),
    "epoll_ctl": Number(233, 21),
    "epoll_wait": Number(232, None),
    "epoll_pwait": Number(281, 22),
    "eventfd2": Number(290, 19),
    # the socket to the runner
    "sendto": Number(44, 206),
    "recvfrom": Number(45, 207),
    "shutdown": Number(48, 210),
    "getsockname": Number(51, 204),
    "getpeername": Number(52, 205),
    "getsockopt": Number(55, 209),
    # the machine
    "uname": Number(63, 160),
    "sysinfo": Number(99, 179),
    "getrandom": Number(318, 278),
}
"""Calls that may be made with any arguments."""

BOUNDED = {
    "fcntl": Number(72, 25),
    "ioctl": Number(16, 29),
    "prctl": Number(157, 167),
    "prlimit64": Number(302, 261),
    "kill": Number(62, 129),
    "tgkill": Number(234, 131),
    "clone": Number(56, 220),
    "sched_setaffinity": Number(203, 122),
}
"""Calls of which ``seccomp`` looks at the arguments."""

ABSENT = {
    "clone3": Number(435, 435),
}
"""Calls that there are none of, says the filter: what libraries make instead can be looked at."""

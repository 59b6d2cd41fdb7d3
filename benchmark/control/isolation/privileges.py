"""Linux: a process gives up what root may do beyond its own files, for ever."""

import ctypes
import errno
import struct
import sys

SET_NO_NEW_PRIVILEGES, DROP_BOUNDING, AMBIENT, CLEAR_AMBIENT = 38, 24, 47, 4  # of prctl
VERSION = 0x20080522  # of capget and capset: two words for each set
WORDS = 6  # effective, permitted, inheritable, twice


def drop() -> None:
    """Give up all capabilities: ambient, bounding, then effective, permitted, inheritable.

    Where the bounding set may not be shrunk, it gives nobody anything: nothing gains by it
    without another program, and none can be started.

    Raises:
        OSError: some are left.
    """
    if sys.platform != "linux":
        return
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]
    if libc.prctl(SET_NO_NEW_PRIVILEGES, 1, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "new privileges cannot be ruled out")
    libc.prctl(AMBIENT, CLEAR_AMBIENT, 0, 0, 0)
    number = 0
    while not libc.prctl(DROP_BOUNDING, number, 0, 0, 0):
        number += 1
    if ctypes.get_errno() not in (errno.EINVAL, errno.EPERM):  # past the last one; not root
        raise OSError(ctypes.get_errno(), "capabilities cannot be given up")
    header = struct.pack("Ii", VERSION, 0)
    if libc.capset(header, struct.pack(f"{WORDS}I", *[0] * WORDS)):
        raise OSError(ctypes.get_errno(), "capabilities cannot be given up")
    if any(_current(libc)):
        raise OSError(errno.EPERM, "capabilities cannot be given up")


def _current(libc: ctypes.CDLL) -> tuple[int, ...]:
    sets = ctypes.create_string_buffer(4 * WORDS)
    if libc.capget(struct.pack("Ii", VERSION, 0), sets):
        raise OSError(ctypes.get_errno(), "capabilities cannot be read")
    return struct.unpack(f"{WORDS}I", sets.raw)

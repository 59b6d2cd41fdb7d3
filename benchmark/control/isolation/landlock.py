"""Linux: a process gives up all files but those it names, for ever and without root (Landlock)."""

import ctypes
import os
import struct
import sys
from collections.abc import Iterable
from pathlib import Path

CREATE, ADD_RULE, RESTRICT = 444, 445, 446  # system calls, the same on every machine
PATH_BENEATH = 1
WRITE_FILE, READ_FILE, READ_DIRECTORY = 1 << 1, 1 << 2, 1 << 3
REMOVE, MAKE, MOVE_AND_TRUNCATE = 0b11 << 4, (1 << 7) | (1 << 8), 0b11 << 13  # folders and files
RIGHTS = {1: 13, 2: 14, 3: 15, 4: 15}  # by version, bits of rights on files; 16 from version 5 on
CONNECT_AND_BIND = 0b11  # TCP, from version 4 on
SOCKETS_AND_SIGNALS = 0b11  # to processes elsewhere, from version 6 on
SET_NO_NEW_PRIVILEGES = 38  # of prctl
VERSION_ONLY = 1


def _libc() -> ctypes.CDLL:
    libc = ctypes.CDLL(None, use_errno=True)
    libc.syscall.restype = ctypes.c_long
    return libc


def version() -> int:
    """The kernel's version of Landlock; 0 where there is none."""
    if sys.platform != "linux":
        return 0
    none, size = ctypes.c_void_p(), ctypes.c_size_t()
    version = _libc().syscall(ctypes.c_long(CREATE), none, size, ctypes.c_uint(VERSION_ONLY))
    return max(0, int(version))


def restrict(
    readable: Iterable[str], listed: Iterable[str] = (), writable: Iterable[str] = ()
) -> None:
    """From now on this process reads, lists or writes these files and folders alone, and /dev/null.

    Raises:
        OSError: the kernel refuses.
    """
    libc, known = _libc(), version()
    attributes = [(1 << RIGHTS.get(known, 16)) - 1]
    attributes += [CONNECT_AND_BIND] if known >= 4 else []
    attributes += [SOCKETS_AND_SIGNALS] if known >= 6 else []
    packed = struct.pack(f"{len(attributes)}Q", *attributes)
    rules = _checked(libc.syscall(ctypes.c_long(CREATE), packed, ctypes.c_size_t(len(packed)), 0))
    try:
        for path in readable:
            _allow(libc, rules, path, READ_FILE | READ_DIRECTORY)
        for path in listed:
            _allow(libc, rules, path, READ_DIRECTORY)
        for path in writable:
            rights = READ_FILE | READ_DIRECTORY | WRITE_FILE | REMOVE | MAKE | MOVE_AND_TRUNCATE
            _allow(libc, rules, path, rights & attributes[0])
        _allow(libc, rules, os.devnull, READ_FILE | WRITE_FILE)
        _checked(
            libc.prctl(SET_NO_NEW_PRIVILEGES, *[ctypes.c_ulong(number) for number in (1, 0, 0, 0)])
        )
        _checked(libc.syscall(ctypes.c_long(RESTRICT), ctypes.c_int(rules), ctypes.c_uint(0)))
    finally:
        os.close(rules)


def _allow(libc: ctypes.CDLL, rules: int, path: str, rights: int) -> None:
    try:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:  # what is not there cannot be read either
        return
    try:
        if not Path(path).is_dir():
            rights &= ~READ_DIRECTORY
        rule = struct.pack("=Qi", rights, place)
        call = ctypes.c_long(ADD_RULE), ctypes.c_int(rules), ctypes.c_int(PATH_BENEATH)
        _checked(libc.syscall(*call, rule, ctypes.c_uint(0)))
    finally:
        os.close(place)


def _checked(result: int) -> int:
    if result < 0:
        raise OSError(ctypes.get_errno(), "Landlock refused")
    return int(result)

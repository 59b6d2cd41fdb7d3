"""What an isolated controller might try: each tried for real, within the walls and without."""

import errno
import json
import struct
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
from factories.processes import PATIENCE

from benchmark.control.isolation import landlock, namespace, process, seccomp, syscalls
from benchmark.control.isolation.attempts import PROTECTIONS, SECCOMP, THROUGH
from benchmark.control.isolation.limits import Limits
from benchmark.control.isolation.probe import Verdict, probe

ROOMY = Limits(step=PATIENCE, start=PATIENCE)
WITHOUT = """
import json, sys, tempfile
from pathlib import Path
from benchmark.control.isolation import attempts
tempfile.tempdir = sys.argv[2]
print(json.dumps(attempts.tried(Path(sys.argv[1]))))
"""
PRIVILEGED = {  # refused to an ordinary user anyway, or to some
    *("fanotify", "perf_event_open", "bpf", "reboot", "sethostname", "chroot", "acct", "syslog"),
    *("mount", "io_uring", "setns", "have any", "keyring", "ptrace", "execve", "setxattr"),
    *("process_vm_readv", "internet", "packets", "scheduler", "clone3", "unshare"),
}

needs_all = pytest.mark.skipif(
    not (seccomp.available() and landlock.version()), reason="no seccomp or Landlock here"
)


def outcomes(verdicts: list[Verdict]) -> dict[str, dict[str, str]]:
    return {verdict.protection.name: dict(verdict.outcomes) for verdict in verdicts}


@pytest.fixture(scope="module")
def verdicts() -> list[Verdict]:
    return probe(ROOMY)


@needs_all
@pytest.mark.parametrize("name", [protection.name for protection in PROTECTIONS])
def test_nothing_gets_through(verdicts: list[Verdict], name: str) -> None:
    (verdict,) = (one for one in verdicts if one.protection.name == name)
    if verdict.protection.needs.startswith("a mount namespace") and not namespace.available():
        pytest.skip("no mount namespace here")
    assert verdict.outcomes.keys() == verdict.protection.attempts.keys()
    assert verdict.open == ()
    if verdict.protection.needs == SECCOMP:
        assert set(verdict.outcomes.values()) <= {"EPERM", "ENOSYS", "ValueError"}


@pytest.mark.skipif(sys.platform != "linux", reason="the attempts are Linux's")
def test_without_walls_the_attempts_succeed(tmp_path: Path) -> None:
    """So what is refused in isolation is refused by isolation."""
    victim = tmp_path / "home" / "victim"
    victim.parent.mkdir()
    for name in ("victim", "spare"):
        (victim.parent / name).write_text("")
    (victim.parent / "alias").symlink_to(victim)
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, str(victim), str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
        cwd=tmp_path,
    )
    found: Mapping[str, str] = json.loads(done.stdout)
    failed = {name.split(": ")[1] for name, outcome in found.items() if outcome != THROUGH}
    assert failed <= PRIVILEGED, found


NO_NAMESPACE = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[2]); "
    "from benchmark.control.isolation import namespace; namespace.enter = lambda *_: False; "
    "from benchmark.control.isolation.child import main; main()"
)


@needs_all
def test_without_namespaces_paths_are_seen_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(process, "START", NO_NAMESPACE)
    through = {one.protection.name: one.open for one in probe(ROOMY) if one.open}
    assert through == {"whether a path exists, its size and times": ("stat", "readlink")}


@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
def test_the_filter_allows_what_is_listed_and_nothing_else(machine: str) -> None:
    """The program is interpreted here, for both machines."""
    program = seccomp._program(machine, 42)
    allowed = {getattr(call, machine) for call in syscalls.ALLOWED.values()} - {None}
    bounded = {getattr(call, machine) for call in syscalls.BOUNDED.values()}
    absent = {getattr(call, machine) for call in syscalls.ABSENT.values()}
    for number in range(520):
        result = answer(program, machine, number, (0xFFFF, 0xFFFF, 1))
        if number in allowed:
            assert result == seccomp.ALLOW
        elif number in absent:
            assert result == seccomp.REFUSE + errno.ENOSYS
        else:
            assert result == seccomp.REFUSE + errno.EPERM, number
    assert not allowed & bounded
    assert answer(program, machine, seccomp.FOREIGN_NUMBERS, (0, 0, 0)) != seccomp.ALLOW
    other = next(one for one in seccomp.MACHINES if one != machine)
    assert answer(program, other, min(allowed), (0, 0, 0)) != seccomp.ALLOW


@pytest.mark.parametrize(
    ("call", "given", "is_allowed"),
    [
        ("kill", (42, 9, 0), True),
        ("kill", (43, 9, 0), False),
        ("kill", (2**64 - 1, 9, 0), False),
        ("tgkill", (42, 44, 9), True),
        ("clone", (0x10000 | 0xF00, 0, 0), True),
        ("clone", (17, 0, 0), False),
        ("clone", (0x10000 | 0x10000000, 0, 0), False),
        ("fcntl", (3, 4, 0), True),
        ("fcntl", (3, 8, 0), False),  # F_SETOWN
        ("fcntl", (3, 10, 0), False),  # F_SETSIG
        ("fcntl", (3, 15, 0), False),  # F_SETOWN_EX
        ("fcntl", (3, 1024, 0), False),  # F_SETLEASE
        ("fcntl", (3, 1026, 0), False),  # F_NOTIFY
        ("ioctl", (3, 0x5401, 0), True),
        ("ioctl", (3, 0x5412, 0), False),  # TIOCSTI
        ("ioctl", (3, 0x8902, 0), False),  # SIOCSPGRP, as F_SETOWN
        ("prctl", (15, 0, 0), True),
        ("prctl", (1, 0, 0), False),
        ("prctl", (0x59616D61, 0, 0), False),  # who may trace it
        ("sched_setaffinity", (0, 8, 0), True),
        ("sched_setaffinity", (7, 8, 0), False),
        ("prlimit64", (0, 7, 0), True),
        ("prlimit64", (42, 7, 0), True),
        ("prlimit64", (43, 7, 0), False),
        ("prlimit64", (0, 7, 1), False),
        ("prlimit64", (0, 7, 1 << 40), False),
    ],
)
@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
def test_of_some_calls_the_arguments_count(
    machine: str, call: str, given: tuple[int, int, int], is_allowed: bool
) -> None:
    number = getattr(syscalls.BOUNDED[call], machine)
    result = answer(seccomp._program(machine, 42), machine, number, given)
    assert (result == seccomp.ALLOW) is is_allowed


def answer(program: bytes, machine: str, number: int, given: tuple[int, int, int]) -> int:
    """What the kernel's interpreter makes of a call."""
    seen = struct.pack("<IIQ6Q", number, seccomp.MACHINES[machine], 0, *given, 0, 0, 0)
    place, value = 0, 0
    while True:
        code, yes, no, operand = struct.unpack_from("HBBI", program, 8 * place)
        place += 1
        if code == seccomp.LOAD:
            (value,) = struct.unpack_from("<I", seen, operand)
        elif code == seccomp.RETURN:
            return int(operand)
        else:
            tests = {
                seccomp.EQUAL: value == operand,
                seccomp.AT_LEAST: value >= operand,
                seccomp.ANY_BIT: bool(value & operand),
            }
            place += yes if tests[code] else no

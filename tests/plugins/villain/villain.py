"""A controller that attacks the benchmark in the way its option names."""

import contextlib
import ctypes
import gc
import importlib
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmark.control.controller import Command, Controller, Drive, Go, Phase
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState

HERE = Path(__file__).parent
hoard: list[bytearray] = []


class Villain(Controller):
    """Behaves, but for one deed.

    Args:
        deed: what it does.
        begin: when in the episode [s].
    """

    def __init__(self, deed: str = "nothing", begin: float = 3.0) -> None:
        self.deed, self.begin = deed, begin

    def reset(self, intersection: Intersection, seed: int) -> None:
        if self.deed == "sleep-in-reset":
            sleep()
        if self.deed == "exit-hard-in-reset":
            os._exit(4)

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        commands: dict[str, Command] = {one.id: Go() for one in state.deciding}
        if state.time < self.begin or self.deed not in DEEDS:
            return commands
        answer = DEEDS[self.deed](state)
        return commands if answer is None else answer


def loop(state: object = None) -> None:
    while True:
        pass


def sleep() -> None:
    while True:
        time.sleep(1)


def loop_deaf(state: object) -> None:
    for number in set(signal.Signals) - {signal.SIGKILL, signal.SIGSTOP}:
        signal.signal(number, signal.SIG_IGN)
    while True:
        with contextlib.suppress(BaseException):
            loop()


def hoard_memory(state: object) -> None:
    while True:
        hoard.append(bytearray(50_000_000))


def hoard_silently(state: object) -> None:
    """Out of memory for good, and nobody learns of it."""
    size = 1 << 26
    while size:
        try:
            hoard.append(bytearray(size))
        except MemoryError:
            size //= 2


def shout(state: object) -> None:
    for stream in (sys.stdout, sys.stderr):
        stream.write("all mine " * 100_000)
    for number in (1, 2):
        os.write(number, b"all mine " * 100_000)


class Huge(Mapping[str, Command]):
    """Has no end."""

    def __getitem__(self, key: str) -> Command:
        return Go()

    def __len__(self) -> int:
        return sys.maxsize

    def __iter__(self) -> Iterator[str]:
        number = 0
        while True:
            number += 1
            yield f"rv{number}" * 2000


class Raising(Huge):
    """Cannot be read."""

    def __iter__(self) -> Iterator[str]:
        raise RuntimeError("no keys for you")


class Rows(dict[str, Command]):
    """Is one thing to those who ask for items and another to those who iterate."""

    def items(self) -> Any:
        return [("rv", Go(), "more")]


def drive(*values: Any) -> Callable[[TrafficState], dict[str, Any]]:
    return lambda state: {one.id: Drive(*values) for one in state.vehicles if one.is_robot}


def nonsense(state: TrafficState) -> dict[Any, Any]:
    target = state.vehicles[0].id if state.vehicles else "nobody"
    return {target: "go", 7: Go(), None: None, "phase": Phase(3), "x": Phase("all green")}  # type: ignore[arg-type]


def line() -> socket.socket:
    """The socket to the runner."""
    return next(one for one in gc.get_objects() if type(one) is socket.socket)


def send(data: bytes) -> Callable[[object], None]:
    def deed(state: object) -> None:
        line().sendall(data)
        sleep()

    return deed


def trickle(state: object) -> None:
    line().sendall((50).to_bytes(4))
    while True:
        line().sendall(b"x")
        time.sleep(0.05)


def hang_up(state: object) -> None:
    line().shutdown(socket.SHUT_RDWR)
    sleep()


def patch_benchmark(state: object) -> None:
    """Everybody waits for nothing and every command stands, at least in this process."""
    arbitration = importlib.import_module("benchmark.control.arbitration")
    arbitration.held_by_conflict = lambda *_: False  # type: ignore[attr-defined]
    type(state)._waiting = property(lambda self: 0.0)  # type: ignore[attr-defined]
    for name in list(sys.modules):
        if name.startswith("benchmark."):
            for key, value in list(vars(sys.modules[name]).items()):
                if isinstance(value, float):
                    setattr(sys.modules[name], key, 0.0)


def mutate(state: TrafficState) -> None:
    """Past all guards of the language: by garbage collector and object.__setattr__."""
    for table in (state.intersection.lanes, state.intersection.movements):
        (inner,) = gc.get_referents(table)
        inner.clear()
    object.__setattr__(state, "vehicles", ())
    object.__setattr__(state.intersection, "control_zone", 1e9)


def imports(name: str) -> Callable[[object], None]:
    return lambda state: importlib.import_module(name) and None


def simulate(state: object) -> None:
    """Past the gate, a libsumo: in this process there is nothing for it to steer."""
    sys.meta_path[:] = [one for one in sys.meta_path if type(one).__name__ != "Gate"]
    libsumo = importlib.import_module("libsumo")
    for name in libsumo.vehicle.getIDList():
        libsumo.vehicle.remove(name)


def fork(state: object) -> None:
    if os.fork() == 0:
        os.setsid()
        time.sleep(60)


def spawn(state: object) -> None:
    subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"], start_new_session=True)


def kill_itself(state: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def kill_the_runner(state: object) -> None:
    os.kill(os.getppid(), signal.SIGKILL)


def kill_all(state: object) -> None:
    os.kill(-1, signal.SIGKILL)


def connect(state: object) -> None:
    socket.create_connection(("127.0.0.1", 9), timeout=1)


def outlive(state: object) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(1, 0, 0, 0, 0):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def raise_limit(state: object) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def read(place: str) -> Callable[[object], None]:
    return lambda state: Path((HERE / place).read_text()).read_bytes() and None


def attempt(**deeds: Callable[[object], None]) -> Callable[[object], None]:
    """Tries one after another and raises with what came of each."""

    def deed(state: object) -> None:
        came = {}
        for name, one in deeds.items():
            try:
                came[name] = repr(one(state))
            except (OSError, ValueError) as error:
                came[name] = type(error).__name__
        raise RuntimeError(repr(came))

    return deed


def write(state: object) -> None:
    Path("here").write_text("x" * 1_000_000)


def delete(state: object) -> None:
    (HERE / "victim.txt").unlink()


def look_around(state: object) -> None:
    """Raises with what it finds that it should not have."""
    opened = []
    for number in range(3, 256):
        with contextlib.suppress(OSError):
            os.fstat(number)
            opened.append(number)
    found = {
        "environment": sorted(os.environ.keys() - {"LC_CTYPE"}),
        "descriptors": len(opened),
        "arguments": sys.argv[3:],
        "folder": [one.name for one in Path.cwd().iterdir()],
        "runner": [name for name in sys.modules if name.startswith(("libsumo", "benchmark.sim"))],
    }
    raise RuntimeError(repr(found))


DEEDS: dict[str, Callable[[Any], Any]] = {
    "loop": loop,
    "loop-deaf": loop_deaf,
    "doze": lambda state: time.sleep(0.2),
    "exit": lambda state: sys.exit("enough"),
    "exit-hard": lambda state: os._exit(3),
    "kill-itself": kill_itself,
    "crash": lambda state: ctypes.string_at(0) and None,
    "hoard": hoard_memory,
    "hoard-silently": hoard_silently,
    "shout": shout,
    "huge-answer": lambda state: Huge(),
    "raising-answer": lambda state: Raising(),
    "two-faced-answer": lambda state: Rows(rv=Go()),
    "long-name": lambda state: {"x" * 10_000: Go()},
    "many-commands": lambda state: {f"rv{number}": Go() for number in range(100_000)},
    "list": lambda state: ["go"],
    "nan": drive(float("nan")),
    "no-number": drive("fast"),
    "no-lane": drive(0.0, "left"),
    "no-text": lambda state: {"\ud800": Go()},
    "unknown-vehicle": lambda state: {"nobody": Go(), "": Drive(1.0)},
    "nonsense": nonsense,
    "garbage": send((4).to_bytes(4) + b"\xc1\xc1\xc1\xc1"),
    "pickle": send((12).to_bytes(4) + b"\x80\x04cos\n_exit\n."),
    "wrong-answer": send((7).to_bytes(4) + b"\x91\xa5Begun"),
    "endless-frame": send(b"\xff\xff\xff\xff"),
    "trickle": trickle,
    "hang-up": hang_up,
    "patch": patch_benchmark,
    "mutate": mutate,
    "import-libsumo": imports("libsumo"),
    "simulate": simulate,
    "reach-processes": attempt(
        fork=fork,
        spawn=spawn,
        kill_the_runner=kill_the_runner,
        kill_all=kill_all,
        connect=connect,
        raise_limit=raise_limit,
        outlive=outlive,
    ),
    "reach-files": attempt(
        read_cache=read("cache.txt"), read_secret=read("secret.txt"), write=write, delete=delete
    ),
    "look-around": look_around,
}


def __getattr__(name: str) -> Any:
    if name == "Endless":
        sleep()
    if name == "Gone":
        os._exit(5)
    raise AttributeError(name)

"""Notices when a controller reaches beyond the contract, in a process of its own.

It sees import statements and ``importlib.import_module``, and processes and connections that are
started from within ``reset`` and ``act``. Code that means to get round this can: isolation
enforces, this tells.
"""

import builtins
import importlib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

from benchmark.admission.conformance.watching import Watcher

FORBIDDEN = (
    "libsumo",
    "traci",
    "benchmark.run",
    "benchmark.run_study",
    "benchmark.sumo.simulation",
    "benchmark.sumo.demand",
    "benchmark.world.world",
    "benchmark.world.tracking",
    "benchmark.control.guard",
    "benchmark.study",
    "benchmark.records.store",
)
"""Modules that lead to the simulation, to the next departures or to the records."""

EVENTS = {
    "socket.connect": "connects to the network",
    "subprocess.Popen": "starts a process",
    "os.system": "starts a process",
    "os.exec": "starts a process",
    "os.fork": "starts a process",
    "os.posix_spawn": "starts a process",
}
CALLS = (Watcher.reset.__code__, Watcher.act.__code__)

found: list[str] = []
"""What was noticed in this process, each once, as in ``mine.py:3 imports libsumo``."""


def begin() -> None:
    """Look out from now on, until this process ends."""
    plain_import, plain_module = builtins.__import__, importlib.import_module

    def import_(
        name: str,
        globals: Mapping[str, object] | None = None,  # noqa: A002 - named as Python's own
        locals: Mapping[str, object] | None = None,  # noqa: A002
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        if level == 0:
            _look([name, *(f"{name}.{one}" for one in fromlist or ())], sys._getframe(1))
        return plain_import(name, globals, locals, fromlist, level)

    def import_module(name: str, package: str | None = None) -> ModuleType:
        _look([name], sys._getframe(1))
        return plain_module(name, package)

    builtins.__import__ = import_
    importlib.import_module = import_module
    sys.addaudithook(_listen)


def _look(names: Sequence[str], importer: FrameType) -> None:
    own = str(importer.f_globals.get("__name__", "")).partition(".")[0]
    if own in ("benchmark", "libsumo", "traci", "importlib"):
        return  # what the benchmark itself does is no deed of the controller
    for name in names:
        if any(name == one or name.startswith(f"{one}.") for one in FORBIDDEN):
            _note(importer, f"imports {name}")


def _listen(event: str, arguments: tuple[Any, ...]) -> None:
    if event not in EVENTS:
        return
    frame: FrameType | None = sys._getframe(1)
    inner = None
    while frame is not None and frame.f_code not in CALLS:
        inner, frame = frame, frame.f_back
    if frame is not None and inner is not None:
        _note(inner, EVENTS[event])


def _note(frame: FrameType, words: str) -> None:
    line = f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno} {words}"
    if line not in found:
        found.append(line)

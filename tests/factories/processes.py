"""Processes that a test waits for and ends."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

DASK_WORKER = "from distributed.cli.dask_worker import main; main()"
PATIENCE = 300.0  # s for what takes a second where nothing else runs


def kill(pid: int) -> None:
    os.kill(pid, signal.SIGKILL)


def heard(process: subprocess.Popen[str], wanted: str) -> str:
    """What the command says on standard error until it says what is wanted."""
    assert process.stderr is not None
    said = ""
    with _ended_in_time(process):
        while wanted not in said:
            line = process.stderr.readline()
            assert line, said
            said += line
    return said


def first_line(process: subprocess.Popen[str]) -> str:
    """The first line of a process on standard output; empty if there is none."""
    assert process.stdout is not None
    with _ended_in_time(process):
        return process.stdout.readline()


@contextmanager
def _ended_in_time(process: subprocess.Popen[str]) -> Iterator[None]:
    """Nobody listens for ever: a process that is silent for too long is ended."""
    timer = threading.Timer(PATIENCE, process.kill)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def pid_in(marker: Path) -> int:
    """The process that has come to this marker, and stays there."""
    wait_for(lambda: marker.exists() and bool(marker.read_text()))
    return int(marker.read_text())


@contextmanager
def worker_of(address: str, *first: Path, script: str = DASK_WORKER) -> Iterator[None]:
    """A worker's process with folders first on its path, as long as the context."""
    path = os.pathsep.join(map(str, [*first, *sys.path]))
    options = ["--nthreads", "1", "--no-dashboard", "--no-nanny"]
    process = subprocess.Popen(
        [sys.executable, "-c", script, address, *options],
        env={**os.environ, "PYTHONPATH": path},
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.kill()
        process.wait(PATIENCE)


def without_sumo(folder: Path) -> Path:
    """A folder for PYTHONPATH that makes every import of SUMO's packages fail."""
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(
        "import sys\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.split('.')[0] in ('libsumo', 'sumo', 'sumolib', 'traci'):\n"
        "            raise ImportError(f'{name} is not here')\n"
        "sys.meta_path.insert(0, Finder())\n"
    )
    return folder

"""What happens on a Dask worker: an episode runs in a supervised process of its own there.

So it has the same limits as on this machine, and a crash costs the episode and not the worker.
What it needs is imported only after the environment has been found to be the same.
"""

import pickle
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmark.records.record import Record
    from benchmark.study.episode import Episode
    from benchmark.study.worker import Worker

GLANCE = 1.0  # s between looks at whether an episode is still wanted
REST = 30.0  # s that a process waits for another episode


@dataclass(frozen=True)
class Job:
    """An episode as it travels."""

    episode: "Episode"
    time_limit: float  # s of wall time for one try
    files: Mapping[str, bytes]  # the file of its controller and what lies beside it, by name


@dataclass(frozen=True)
class Refused:
    """Why a Dask worker runs no episode."""

    worker: str  # its address
    reason: str


def run(wanted: Mapping[tuple[str, str], str], job: bytes) -> "Record | Refused":
    """Run an episode here, if here is what is wanted.

    Args:
        wanted: the environment, as ``benchmark.study.cluster.environment.needed`` has it.
        job: a pickled ``Job``; what pickled it may be of another version than this.
    """
    from distributed import get_worker

    from benchmark.study.cluster import environment

    worker = get_worker()
    try:
        if found := environment.differences(wanted):
            return Refused(worker.address, "; ".join(found))
        given: Job = pickle.loads(job)  # noqa: S301 - from the scheduler, which may run any code
        episode = _placed(given, Path(worker.local_directory))
        with _supervised(worker.local_directory, given.time_limit) as process:
            key = worker.get_current_task()
            with _watched(process, lambda: _is_wanted(worker, key)):
                return process.run(episode)
    except Exception as error:
        return Refused(worker.address, f"{type(error).__name__}: {error}")


def _placed(job: Job, folder: Path) -> "Episode":
    """A job's episode with the controller's file where it is on this machine.

    Where the same files lie at the same place they are taken, with all else that lies there.
    """
    from benchmark.control import reference as naming

    if not job.files:
        return job.episode
    reference = naming.parse(job.episode.controller)
    place = Path(reference.place)
    with suppress(OSError):
        if all((place.parent / name).read_bytes() == it for name, it in job.files.items()):
            return job.episode
    copy = replace(reference, place=str(_written(job.files, folder) / place.name))
    return replace(job.episode, controller=str(copy))


def _written(files: Mapping[str, bytes], folder: Path) -> Path:
    """A folder that holds just these files."""
    import hashlib

    code = hashlib.sha256(pickle.dumps(sorted(files.items()))).hexdigest()
    place = folder / "controllers" / code
    with _lock:
        if not place.exists():
            draft = place.with_suffix(".draft")
            draft.mkdir(parents=True, exist_ok=True)
            for name, content in files.items():
                (draft / name).write_bytes(content)
            draft.rename(place)
    return place


# --- processes, which are kept for the next episode ---------------------------------------------

_lock = threading.Lock()
_busy: set["Worker"] = set()
_resting: list[tuple[float, "Worker"]] = []  # with the time limit of each
_bedtime: threading.Timer | None = None


@contextmanager
def _supervised(folder: str, time_limit: float) -> "Iterator[Worker]":
    """A process for one episode at a time, new or one that had nothing to do."""
    process = _woken(time_limit) or _new(folder, time_limit)
    _busy.add(process)
    try:
        yield process
    except BaseException:
        process.close()
        raise
    else:
        _rest(process, time_limit)
    finally:
        _busy.discard(process)


def _new(folder: str, time_limit: float) -> "Worker":
    from benchmark.study.worker import Worker

    _prepare()
    return Worker(folder, time_limit)


@cache
def _prepare() -> None:
    """Let this process have children: a nanny's may not, and any would wait for them at its end."""
    import multiprocessing
    from multiprocessing import util

    multiprocessing.current_process().daemon = False
    util.Finalize(None, _end_all, exitpriority=100)


def _woken(time_limit: float) -> "Worker | None":
    with _lock:
        for index, (limit, process) in enumerate(_resting):
            if limit == time_limit:
                del _resting[index]
                return process
    return None


def _rest(process: "Worker", time_limit: float) -> None:
    """Keep a process until no episode has come for a while: the cluster may have other users."""
    global _bedtime
    with _lock:
        _resting.append((time_limit, process))
        if _bedtime is not None:
            _bedtime.cancel()
        _bedtime = threading.Timer(REST, _end_resting)
        _bedtime.daemon = True
        _bedtime.start()


def _end_resting() -> None:
    with _lock:
        ended, _resting[:] = [process for _, process in _resting], []
    for process in ended:
        process.close()


def _end_all() -> None:
    for process in tuple(_busy):
        process.cancel()
    _end_resting()


# --- episodes that nobody waits for any more ----------------------------------------------------


@contextmanager
def _watched(process: "Worker", is_wanted: Callable[[], bool]) -> Iterator[None]:
    """Stop the process's episode when it is no longer wanted: Dask itself cannot.

    Raises:
        CancelledError: it was stopped.
    """
    done, stopped = threading.Event(), threading.Event()

    def watch() -> None:
        while not done.wait(GLANCE):
            if not is_wanted():
                stopped.set()
                process.cancel()
                return

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
    if stopped.is_set():  # just as it ended; the process is of no more use
        raise CancelledError


def _is_wanted(worker: Any, key: object) -> bool:
    task = worker.state.tasks.get(key)
    return task is not None and task.state != "cancelled"

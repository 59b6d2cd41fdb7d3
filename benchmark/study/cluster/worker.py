"""What happens on a Dask worker: an episode runs in a supervised process of its own there.

So it has the same limits as on this machine, and a crash costs the episode and not the worker.
What it needs is imported only after the environment has been found to be the same.
"""

import pickle
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmark.records.record import Record
    from benchmark.study.episode import Episode
    from benchmark.study.worker import Worker

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
        if differing := environment.differences(wanted):
            return Refused(worker.address, "; ".join(differing))
        given: Job = pickle.loads(job)  # noqa: S301 - from the scheduler, which may run any code
        episode = _placed(given, Path(worker.local_directory))
        with _supervised(worker.local_directory, given.time_limit) as process:
            return process.run(episode, partial(_is_wanted, worker, worker.get_current_task()))
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
        if all(
            (place.parent / name).read_bytes() == content for name, content in job.files.items()
        ):
            return job.episode
    copy = replace(reference, place=str(_written(job.files, folder) / place.name))
    return replace(job.episode, controller=str(copy))


def _written(files: Mapping[str, bytes], folder: Path) -> Path:
    """A folder that holds just these files."""
    import hashlib

    from benchmark.plumbing.files import made_once

    def fill(draft: Path) -> None:
        for name, content in files.items():
            (draft / name).write_bytes(content)

    code = hashlib.sha256(pickle.dumps(sorted(files.items()))).hexdigest()
    return made_once(folder / "controllers" / code, fill)


_lock = threading.Lock()
_busy: set["Worker"] = set()
_resting: dict["Worker", tuple[float, threading.Timer]] = {}  # with time limit and what ends it


@contextmanager
def _supervised(folder: str, time_limit: float) -> "Iterator[Worker]":
    """A process for one episode at a time, new or one that had nothing to do for a while.

    It rests until no episode has come for a while: the cluster may have other users.
    """
    process = _woken(time_limit) or _new(folder, time_limit)
    _busy.add(process)
    try:
        yield process
    except BaseException:
        process.close()
        raise
    else:
        bedtime = threading.Timer(REST, _end_resting, [process])
        bedtime.daemon = True
        with _lock:
            _resting[process] = time_limit, bedtime
        bedtime.start()
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
        for process, (limit, bedtime) in _resting.items():
            if limit == time_limit:
                del _resting[process]
                bedtime.cancel()
                return process
    return None


def _end_resting(process: "Worker") -> None:
    with _lock:
        if _resting.pop(process, None) is None:  # it was woken just now
            return
    process.close()


def _end_all() -> None:
    for process in tuple(_busy):
        process.cancel()
    for process in tuple(_resting):
        _end_resting(process)


def _is_wanted(worker: Any, key: object) -> bool:
    """Whether the cluster still waits for a task; Dask itself cannot stop one."""
    task = worker.state.tasks.get(key)
    return task is not None and task.state != "cancelled"

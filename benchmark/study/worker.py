"""One worker process for episodes, supervised on its own: it may crash, hang, leak or be killed."""

import os
import signal
import tempfile
import threading
import time as clock
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.plumbing.errors import StoreError
from benchmark.plumbing.processes import pool
from benchmark.records.record import Record
from benchmark.study import outcome
from benchmark.study.episode import Episode, run_episode

if TYPE_CHECKING:
    from pebble import ProcessPool

LEAK = 1024.0  # MB that a process may grow by before another takes its place
GLANCE = 1.0  # s between looks at whether a process is being supervised still


class Worker:
    """One process that runs one episode after the other, and is replaced when it dies or hangs.

    A pool of its own for each: a process that is killed while it talks to its pool leaves locks
    and half a message behind, which must not hurt its neighbours.

    Args:
        folder: for temporary files, as a process that is killed cannot clear its own away.
        time_limit: wall time for one try at an episode [s].
        work: what to do with an episode.
    """

    def __init__(
        self, folder: str, time_limit: float = outcome.TIME_LIMIT, work: outcome.Work = run_episode
    ) -> None:
        self._folder, self._time_limit, self._work = folder, time_limit, work
        self._pool: ProcessPool | None = None
        self._future: Future[Done] | None = None
        self._cancelled, self._lock = False, threading.Lock()

    def run(self, episode: Episode, is_wanted: Callable[[], bool] = lambda: True) -> Record:
        """Run an episode; one that crashes or takes too long is tried once more.

        Args:
            episode: the episode.
            is_wanted: asked now and then whether somebody still waits for it.

        Raises:
            CancelledError: ``cancel`` was called, or nobody waits any more.
            StoreError: the process cannot write what it is to keep.
        """
        record = self._try(episode, is_wanted)
        for _ in range(outcome.TRIES - 1):
            if outcome.is_settled(record.status):
                break
            outcome.log_retry(record)
            record = self._try(episode, is_wanted)
        return record

    def cancel(self) -> None:
        """Let ``run`` end at once, and run nothing any more; from any thread."""
        with self._lock:
            self._cancelled = True
            if self._future is not None:
                self._future.cancel()

    def close(self) -> None:
        """End the process; the next episode gets another."""
        if self._pool is not None:
            self._pool.stop()  # type: ignore[no-untyped-call]
            self._pool.join()
            self._pool = None

    def _try(self, episode: Episode, is_wanted: Callable[[], bool]) -> Record:
        from pebble import ProcessExpired

        try:
            done = self._wait_for(self._schedule(episode), is_wanted)
        except TimeoutError:
            record = outcome.too_slow(episode, self._time_limit)
        except ProcessExpired as error:
            record = outcome.died(episode, _how(error.exitcode))
        except BrokenProcessPool:
            record = outcome.died(episode, "before it could begin")
        except (CancelledError, StoreError):
            raise
        except Exception as error:
            record = outcome.raised(episode, error)
        else:
            record = done.record
            if not record.is_failure and done.growth <= LEAK:
                return record
        self.close()  # whatever a controller that failed has left behind goes with it
        return record

    def _schedule(self, episode: Episode) -> "Future[Done]":
        if self._pool is not None and not self._pool.active:  # it died between two episodes
            self.close()
        if self._pool is None:
            self._pool = pool(1, _begin, self._folder)
        with self._lock:
            if self._cancelled:
                raise CancelledError
            self._future = self._pool.schedule(
                _run, args=(self._work, episode), timeout=self._time_limit
            )
            return self._future

    def _wait_for(self, future: "Future[Done]", is_wanted: Callable[[], bool]) -> "Done":
        """What becomes of an episode; also where its process died before it knew of it.

        The pool limits the time from when the process has begun, and forgets what it was given
        just as it broke.
        """
        ended, deadline = threading.Event(), clock.monotonic() + self._time_limit
        future.add_done_callback(lambda _: ended.set())
        while not ended.wait(GLANCE):
            assert self._pool is not None
            if not is_wanted():
                raise CancelledError
            if not self._pool.active:
                raise BrokenProcessPool
            if not future.running() and clock.monotonic() > deadline:
                raise TimeoutError
        return future.result()


@dataclass(frozen=True)
class Done:
    """What a process has to say after an episode."""

    record: Record
    growth: float  # MB of memory since it began


_memory_at_start = 0.0  # MB, of this process where it is a worker


def _begin(folder: str) -> None:
    global _memory_at_start
    tempfile.tempdir = folder
    with suppress(OSError):  # where memory runs out, Linux is to end a worker and nothing else
        Path("/proc/self/oom_score_adj").write_text("1000")
    _memory_at_start = _memory()


def _run(work: outcome.Work, episode: Episode) -> Done:
    return Done(work(episode), _memory() - _memory_at_start)


def _memory() -> float:
    """The memory that this process has in use [MB]; 0 where that is not to be had."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:  # not Linux
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def _how(exitcode: int | None) -> str:
    try:
        return signal.Signals(-(exitcode or 0)).name
    except ValueError:
        return f"exit code {exitcode}"

"""Episodes in worker processes of this machine, each supervised on its own."""

import os
import signal
import sys
import tempfile
import threading
import time as clock
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

from benchmark import outcome
from benchmark.episode import Episode, run
from benchmark.record import Record
from benchmark.workers import pool

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
    """

    def __init__(self, folder: str, time_limit: float = outcome.TIME_LIMIT) -> None:
        self._folder, self._time_limit = folder, time_limit
        self._pool: ProcessPool | None = None
        self._future: Future[Done] | None = None
        self._cancelled, self._lock = False, threading.Lock()

    def run(self, episode: Episode) -> Record:
        """Run an episode; one that crashes or takes too long is tried once more.

        Raises:
            CancelledError: ``cancel`` was called.
        """
        record = self._try(episode)
        for _ in range(outcome.TRIES - 1):
            if outcome.is_settled(record):
                break
            outcome.log_retry(record)
            record = self._try(episode)
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

    def _try(self, episode: Episode) -> Record:
        from pebble import ProcessExpired

        try:
            done = self._wait_for(self._schedule(episode))
        except TimeoutError:
            record = outcome.too_slow(episode, self._time_limit)
        except ProcessExpired as error:
            record = outcome.died(episode, _how(error.exitcode))
        except BrokenProcessPool:
            record = outcome.died(episode, "before it could begin")
        except CancelledError:
            raise
        except Exception as error:
            record = outcome.raised(episode, error)
        else:
            if done.growth <= LEAK:
                return done.record
            record = done.record
        self.close()
        return record

    def _schedule(self, episode: Episode) -> "Future[Done]":
        if self._pool is not None and not self._pool.active:  # it died between two episodes
            self.close()
        if self._pool is None:
            self._pool = pool(1, _begin, self._folder)
        with self._lock:
            if self._cancelled:
                raise CancelledError
            self._future = self._pool.schedule(_run, args=(episode,), timeout=self._time_limit)
            return self._future

    def _wait_for(self, future: "Future[Done]") -> "Done":
        """What becomes of an episode; also where its process died before it knew of it.

        The pool limits the time from when the process has begun, and forgets what it was given
        just as it broke.
        """
        ended, deadline = threading.Event(), clock.monotonic() + self._time_limit
        future.add_done_callback(lambda _: ended.set())
        while not ended.wait(GLANCE):
            assert self._pool is not None
            if not self._pool.active:
                raise BrokenProcessPool
            if not future.running() and clock.monotonic() > deadline:
                raise TimeoutError
        return future.result()


@dataclass(frozen=True)
class Done:
    """What a process has to say after an episode."""

    record: Record
    growth: float  # MB, by which the most it ever had in use exceeds what it began with


_memory_at_start = 0.0  # MB, of this process where it is a worker


def _begin(folder: str) -> None:
    global _memory_at_start
    tempfile.tempdir = folder
    with suppress(OSError):  # where memory runs out, Linux is to end a worker and nothing else
        Path("/proc/self/oom_score_adj").write_text("1000")
    _memory_at_start = _peak_memory()


def _run(episode: Episode) -> Done:
    return Done(run(episode), _peak_memory() - _memory_at_start)


def _peak_memory() -> float:
    """The most memory that this process ever had in use [MB]."""
    try:
        from resource import RUSAGE_SELF, getrusage
    except ImportError:  # Windows
        return 0.0
    return getrusage(RUSAGE_SELF).ru_maxrss / (1024**2 if sys.platform == "darwin" else 1024)


def _how(exitcode: int | None) -> str:
    try:
        return signal.Signals(-(exitcode or 0)).name
    except ValueError:
        return f"exit code {exitcode}"


class LocalPool:
    """Runs episodes in worker processes of this machine.

    Args:
        workers: processes side by side.
        time_limit: wall time for one try at an episode [s].
    """

    def __init__(self, workers: int, time_limit: float = outcome.TIME_LIMIT) -> None:
        self._count, self._time_limit = workers, time_limit
        self._waiting: deque[Episode] = deque()

    def run(self, episodes: Sequence[Episode]) -> Generator[tuple[Episode, Record], None, None]:
        """Yield each episode with its record as it ends; close it to stop at once."""
        self._waiting = deque(episodes)
        ended: SimpleQueue[tuple[Episode, Record] | BaseException | None] = SimpleQueue()
        with tempfile.TemporaryDirectory(
            prefix="rightofway-", ignore_cleanup_errors=True
        ) as folder:
            workers = [
                Worker(folder, self._time_limit) for _ in range(min(self._count, len(episodes)))
            ]
            threads = [
                threading.Thread(target=self._serve, args=(one, ended), daemon=True)
                for one in workers
            ]
            for thread in threads:
                thread.start()
            try:
                serving = len(threads)
                while serving:
                    found = ended.get()
                    if isinstance(found, BaseException):
                        raise found
                    if found is None:
                        serving -= 1
                    else:
                        yield found
            finally:
                self.drain()
                for worker in workers:
                    worker.cancel()
                for thread in threads:
                    thread.join()

    def drain(self) -> None:
        """Start no more episodes; ``run`` ends with those under way."""
        self._waiting.clear()

    def _serve(
        self, worker: Worker, ended: "SimpleQueue[tuple[Episode, Record] | BaseException | None]"
    ) -> None:
        """Let a worker run whatever waits."""
        try:
            while True:
                episode = self._waiting.popleft()
                ended.put((episode, worker.run(episode)))
        except (IndexError, CancelledError):  # nothing waits any more, or the caller stops
            ended.put(None)
        except BaseException as error:  # a fault of ours is not to be lost with its thread
            ended.put(error)
        finally:
            worker.close()


def cores() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

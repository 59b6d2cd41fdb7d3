"""Episodes in worker processes of this machine, each supervised on its own."""

import os
import signal
import tempfile
import threading
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from queue import SimpleQueue
from typing import TYPE_CHECKING

from benchmark import outcome
from benchmark.episode import Episode, run
from benchmark.record import Record
from benchmark.workers import pool

if TYPE_CHECKING:
    from pebble import ProcessPool


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
        self._future: Future[Record] | None = None
        self._stopped, self._lock = False, threading.Lock()

    def run(self, episode: Episode) -> Record:
        """Run an episode; one that crashes or takes too long is tried once more.

        Raises:
            CancelledError: ``stop`` was called.
        """
        for _ in range(outcome.TRIES):
            record = self._try(episode)
            if outcome.is_settled(record):
                break
        return record

    def stop(self) -> None:
        """End the process, in the middle of an episode too; may be called from any thread."""
        with self._lock:
            self._stopped = True
            if self._future is not None:
                self._future.cancel()
            self._give_up()

    def _try(self, episode: Episode) -> Record:
        from pebble import ProcessExpired

        future = self._schedule(episode)
        try:
            return future.result()
        except CancelledError:
            raise
        except TimeoutError:
            record = outcome.too_slow(episode, self._time_limit)
        except ProcessExpired as error:
            record = outcome.died(episode, _how(error.exitcode))
        except BrokenProcessPool:
            record = outcome.died(episode, "before it could begin")
        except Exception as error:
            return outcome.raised(episode, error)
        with self._lock:
            self._give_up()
        return record

    def _schedule(self, episode: Episode) -> "Future[Record]":
        with self._lock:
            if self._stopped:
                raise CancelledError
            if self._pool is not None and not self._pool.active:  # it died between two episodes
                self._give_up()
            if self._pool is None:
                self._pool = pool(1, _keep_files_in, self._folder)
            self._future = self._pool.schedule(run, args=(episode,), timeout=self._time_limit)
            return self._future

    def _give_up(self) -> None:
        if self._pool is not None:
            self._pool.stop()  # type: ignore[no-untyped-call]
            self._pool.join()
            self._pool = None


def _keep_files_in(folder: str) -> None:
    tempfile.tempdir = folder


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
                    worker.stop()
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


def cores() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

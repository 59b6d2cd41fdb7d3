"""Many episodes side by side, in worker processes of this machine."""

import tempfile
import threading
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import CancelledError
from queue import Empty, SimpleQueue

from benchmark.plumbing.processes import GLANCE
from benchmark.records.record import Record
from benchmark.study import outcome
from benchmark.study.episode import Episode, run_episode
from benchmark.study.worker import Worker

Ended = tuple[Episode, Record] | BaseException | None
"""An episode that ended, what must not happen, or a worker that has nothing more to do."""


class LocalPool:
    """Runs episodes in worker processes of this machine: an ``Executor``.

    Args:
        workers: processes side by side.
        time_limit: wall time for one try at an episode [s].
        work: what a worker does with an episode; it must come through pickle.
    """

    def __init__(
        self, workers: int, time_limit: float = outcome.TIME_LIMIT, work: outcome.Work = run_episode
    ) -> None:
        self._count, self._time_limit, self._work = workers, time_limit, work
        self._waiting: deque[Episode] = deque()

    def run(self, episodes: Sequence[Episode]) -> Generator[tuple[Episode, Record], None, None]:
        """Yield each episode with its record as it ends; close it to stop at once.

        Raises:
            StoreError: a worker cannot write what it is to keep.
        """
        self._waiting = deque(episodes)
        ended: SimpleQueue[Ended] = SimpleQueue()
        with tempfile.TemporaryDirectory(
            prefix="rightofway-", ignore_cleanup_errors=True
        ) as folder:
            workers = [
                Worker(folder, self._time_limit, self._work)
                for _ in range(min(self._count, len(episodes)))
            ]
            threads = [
                threading.Thread(target=self._serve, args=(worker, ended), daemon=True)
                for worker in workers
            ]
            for thread in threads:
                thread.start()
            try:
                serving = len(threads)
                while serving:
                    try:  # to wake now and then: see ``benchmark.plumbing.processes.result_of``
                        end = ended.get(timeout=GLANCE)
                    except Empty:
                        continue
                    if isinstance(end, BaseException):
                        raise end
                    if end is None:
                        serving -= 1
                    else:
                        yield end
            finally:
                self.drain()
                for worker in workers:
                    worker.cancel()
                for thread in threads:
                    thread.join()

    def drain(self) -> None:
        """Start no more episodes; ``run`` ends with those under way."""
        self._waiting.clear()

    def _serve(self, worker: Worker, ended: "SimpleQueue[Ended]") -> None:
        """Let a worker run whatever waits."""
        try:
            while (episode := self._next()) is not None:
                ended.put((episode, worker.run(episode)))
            ended.put(None)
        except CancelledError:
            ended.put(None)
        except BaseException as error:  # a fault of ours is not to be lost with its thread
            ended.put(error)
        finally:
            worker.close()

    def _next(self) -> Episode | None:
        try:
            return self._waiting.popleft()
        except IndexError:
            return None

"""Many episodes side by side, on the workers of a Dask cluster."""

import pickle
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmark import __version__
from benchmark.control import code, reference
from benchmark.plumbing.errors import ClusterError, ControllerError
from benchmark.records.record import Record
from benchmark.study import outcome
from benchmark.study.cluster import environment, worker
from benchmark.study.cluster.environment import Environment
from benchmark.study.cluster.stream import Stream
from benchmark.study.episode import Episode

if TYPE_CHECKING:
    from distributed import Client

Ended = tuple[Episode, Record]
Luggage = Mapping[str, Mapping[str, bytes]]
LARGEST_LUGGAGE = 2_000_000  # bytes with each episode, of which up to 1000 are on their way
NAMED = 5  # workers that a message names


class Cluster:
    """Runs episodes on the workers of a Dask cluster; see ``benchmark.study.executor.Executor``.

    Args:
        connect: to the cluster, for as long as episodes run.
        time_limit: wall time for one try at an episode [s].
        notice: told what the user should know.
    """

    def __init__(
        self,
        connect: "Callable[[], AbstractContextManager[Client]]",
        time_limit: float = outcome.TIME_LIMIT,
        notice: Callable[[str], None] = lambda message: None,
    ) -> None:
        self._connect, self._time_limit, self._notice = connect, time_limit, notice
        self._drained = False

    def run(self, episodes: Sequence[Episode]) -> Generator[Ended, None, None]:
        """Yield each episode with its record as it ends; close it to stop at once.

        Raises:
            ClusterError: there is no cluster any more, or a worker is not as this process is; what
                was under way on the others has been yielded.
        """
        self._drained = False
        if not episodes:
            return
        controllers = {one.controller for one in episodes}
        wanted, files = environment.needed(controllers), _files(controllers)
        tries = [_Try(one, one.identity) for one in episodes]
        with self._connect() as client:
            flight = _Flight(client, wanted, files, self._time_limit, tries)
            try:
                if refused := _refused(client, wanted):
                    raise ClusterError(refused)
                if not client.nthreads():
                    self._notice("the cluster has no workers yet; waiting for some")
                while flight:
                    if self._drained:
                        flight.land()
                    yield from flight.ended()
            except OSError as error:
                raise ClusterError(f"the connection to the cluster broke: {error}") from error
            if flight.trouble:
                raise ClusterError(flight.trouble)

    def drain(self) -> None:
        """Start no more episodes; ``run`` ends with those under way."""
        self._drained = True


@dataclass(frozen=True)
class _Try:
    """An episode on its way."""

    episode: Episode
    identity: str  # as it was before
    alone: bool = False  # with no other under way


class _Flight:
    """Episodes between here and the workers."""

    def __init__(
        self,
        client: "Client",
        wanted: Environment,
        files: Luggage,
        time_limit: float,
        tries: Iterable[_Try],
    ) -> None:
        self._client, self._wanted, self._files = client, wanted, files
        self._time_limit = time_limit
        self._waiting = deque(tries)
        self._suspects: deque[_Try] = deque()
        self._stream: Stream[_Try] = Stream(client, worker.run)
        self._landing = False
        self.trouble = ""  # why nothing more can be run

    def __bool__(self) -> bool:
        return bool(self._waiting or self._suspects or len(self._stream))

    def land(self) -> None:
        """Start no more."""
        self._waiting.clear()
        self._suspects.clear()
        if not self._landing:
            self._landing = True
            self._stream.drop_waiting()

    def ended(self) -> Iterator[Ended]:
        """Send off what there is room for, and yield what has ended by now, or shortly."""
        if self._suspects and not (self._waiting or len(self._stream)):
            self._waiting.append(self._suspects.popleft())
        while self._waiting and self._stream.has_room():
            one = self._waiting.popleft()
            self._stream.submit(one, self._wanted, pickle.dumps(self._job(one.episode)))
        for one, result in self._stream.ended():
            if (record := self._record(one, result)) is not None:
                yield one.episode, record
        if self.trouble:
            self.land()

    def _job(self, episode: Episode) -> worker.Job:
        place = reference.parse(episode.controller).place
        return worker.Job(episode, self._time_limit, self._files.get(place, {}))

    def _record(self, one: _Try, result: Any) -> Record | None:
        """What an episode leaves behind, if it is not to be tried again or in vain."""
        from distributed import KilledWorker

        match result:
            case Record():
                # an option may name a file that the episode itself writes
                if result.identity in (one.identity, one.episode.identity):
                    return result
                self.trouble = self.trouble or (
                    f"a worker ran {one.episode.label} with other files than are here; what its "
                    "options name must lie at the same path there, and be the same"
                )
            case CancelledError():  # the scheduler was away
                self._waiting.appendleft(one)
            case KilledWorker():  # by this episode, or by one that was on the same workers
                deaths = result.allowed_failures + 1
                record = outcome.died(one.episode, f"and {deaths} Dask workers with it")
                if one.alone:
                    return record
                outcome.log_retry(record)
                self._suspects.append(replace(one, alone=True))
            case worker.Refused():
                self.trouble = self.trouble or _words({result.worker: result.reason})
            case _:  # a worker or the scheduler cannot even begin
                self.trouble = (
                    self.trouble
                    or _refused(self._client, self._wanted)
                    or (
                        f"the cluster cannot run episodes: {type(result).__name__}: {result}; "
                        "its scheduler and workers need what `rightofway[cluster]` installs here"
                    )
                )
        return None


def _files(controllers: Iterable[str]) -> Luggage:
    """What the files of controllers hold and those beside them, by the controllers' paths.

    Raises:
        ClusterError: they are too large to travel with each episode.
        ControllerError: they cannot be read.
    """
    places = {one.place for one in map(reference.parse, controllers) if one.is_file}
    found = {}
    for place in places:
        try:
            near = code.neighbours(Path(place).parent)
            files = {path.name: path.read_bytes() for path in near}
        except OSError as error:
            raise ControllerError(
                f"{error.filename}: cannot read the controller: {error.strerror}"
            ) from error
        if (size := sum(map(len, files.values()))) > LARGEST_LUGGAGE:
            raise ClusterError(
                f"{place}: with the code and weights in its folder it has {size / 1e6:.1f} MB, and "
                f"at most {LARGEST_LUGGAGE / 1e6:g} MB travel to workers; give it a folder of its "
                "own, or install it there as a package"
            )
        found[place] = files
    return found


def _refused(client: "Client", wanted: Environment) -> str:
    """Why workers that are there now cannot be used; empty if all can."""
    found = client.run(environment.differences, wanted, on_error="return")
    reasons = {
        address: f"it cannot load rightofway {__version__}: {one}"
        if isinstance(one, BaseException)
        else "; ".join(one)
        for address, one in found.items()
    }
    return _words({address: reason for address, reason in reasons.items() if reason})


def _words(refused: Mapping[str, str]) -> str:
    if not refused:
        return ""
    lines = [f"  worker {address}: {reason}" for address, reason in sorted(refused.items())]
    if len(lines) > NAMED:
        lines[NAMED:] = [f"  and {len(lines) - NAMED} more workers"]
    return "\n".join(
        [
            "these workers would give other records, or none; install there what is installed "
            "here, or start them from this environment:",
            *lines,
        ]
    )

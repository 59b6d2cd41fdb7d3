"""Tasks to a cluster and their results back, never more of them than it can soon begin."""

import pickle
import time as clock
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from benchmark.plumbing.errors import ClusterError

if TYPE_CHECKING:
    from distributed import Client, Future

T = TypeVar("T")
LEAST = 1000  # tasks under way, so that a cluster which adapts sees that there is work
PER_THREAD = 2  # one under way and one that waits beside it
GLANCE = 0.02  # s between looks at whether something has ended
COUNT_AGAIN = 5.0  # s after which a cluster may have grown


@dataclass(frozen=True)
class Call:
    """Pickled, a call that is made where it is unpickled, and whose result is what comes out.

    All of Dask can load ``pickle.loads`` and bytes. A worker that cannot load a task's function
    goes down, and another takes its place and goes down too; a scheduler loads it as well.
    """

    function: Callable[..., object]
    arguments: tuple[object, ...]

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return self.function, self.arguments


class Stream(Generic[T]):
    """Calls of one function on a cluster, each for an item of the caller's.

    Args:
        client: of the cluster.
        function: what the workers call.
    """

    def __init__(self, client: "Client", function: Callable[..., object]) -> None:
        from distributed import as_completed

        self._client, self._function = client, function
        assert client.scheduler is not None
        self._address = client.scheduler.address
        self._name, self._number = uuid.uuid4().hex, 0
        self._items: dict[Future[Any], T] = {}
        self._ended = as_completed(with_results=True, raise_errors=False, loop=client.loop)
        self._room, self._counted = LEAST, -COUNT_AGAIN

    def __len__(self) -> int:
        """How many calls are under way."""
        return len(self._items)

    def has_room(self) -> bool:
        """Whether the cluster should be given more."""
        if self._client.status != "running":  # it may be on its way back
            return False
        if len(self) < LEAST:
            return True
        if clock.monotonic() - self._counted > COUNT_AGAIN:
            self._counted = clock.monotonic()
            self._room = max(LEAST, PER_THREAD * sum(self._client.nthreads().values()))
        return len(self) < self._room

    def submit(self, item: T, *arguments: object) -> None:
        """Call the function with these arguments for this item.

        Raises:
            ClusterError: the scheduler has just gone.
        """
        self._number += 1
        key = f"rightofway-{self._name}-{self._number}"
        call = pickle.dumps(Call(self._function, arguments))
        try:
            future = self._client.submit(pickle.loads, call, key=key)
        except Exception as error:
            if self._client.status == "running":
                raise
            raise self._gone() from error
        self._items[future] = item
        self._ended.add(future)

    def ended(self) -> Iterator[tuple[T, Any]]:
        """What has ended by now, or shortly: items with what the function returned or raised.

        A ``CancelledError`` stands for a call that the scheduler has lost.

        Raises:
            ClusterError: the scheduler does not come back.
        """
        if not self._ended.has_ready():
            if self._client.status in ("closing", "closed"):
                raise self._gone()
            clock.sleep(GLANCE)
        for future, result in self._ended.next_batch(block=False):
            if future in self._items:
                item = self._items.pop(future)
                if future.status == "error":
                    yield item, result[1]
                else:
                    yield item, CancelledError() if future.status == "cancelled" else result

    def _gone(self) -> ClusterError:
        return ClusterError(
            f"the scheduler {self._address} is gone; "
            "when there is one again, the same command goes on"
        )

    def drop_waiting(self) -> None:
        """Forget the calls that no worker has begun.

        Raises:
            OSError: the scheduler is away.
        """
        if not self._items:
            return
        stacks = self._client.call_stack(list(self._items))
        begun = {key for worker in stacks.values() for key in worker}
        waiting = [one for one in self._items if one.status == "pending" and one.key not in begun]
        for future in waiting:
            del self._items[future]
        self._client.cancel(waiting)

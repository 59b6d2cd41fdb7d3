"""Worker processes: libsumo holds one simulation in each."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from pebble import ProcessPool


def cores() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def pool(count: int, initializer: Callable[..., None] | None = None, *given: Any) -> "ProcessPool":
    """Started worker processes that end when this process ends.

    Ctrl-C reaches a whole process group; it is this process's to answer, and the workers, even
    those that are only starting, do not hear it.

    Args:
        count: how many.
        initializer: to be called in each worker first.
        given: its arguments.
    """
    from pebble import ProcessPool

    context = multiprocessing.get_context("spawn")
    found = ProcessPool(count, initializer=_begin, initargs=(initializer, *given), context=context)
    with interrupts_held_back():
        assert found.active  # to ask starts it
    return found


@contextmanager
def working(count: int) -> Iterator["ProcessPool"]:
    """Worker processes that end with the context, in the midst of what they do then."""
    found = pool(count)
    try:
        yield found
    finally:
        end(found)


def end(workers: "ProcessPool") -> None:
    """Stop worker processes at once.

    Ctrl-C in the midst of the pool's own code may leave it unable to end; it is given a while.
    """
    workers.stop()  # type: ignore[no-untyped-call]
    ending = threading.Thread(target=workers.join, daemon=True)
    ending.start()
    ending.join(PATIENCE)


Result = TypeVar("Result")
GLANCE = 0.5  # s
PATIENCE = 5.0  # s


def result_of(future: "Future[Result]") -> Result:
    """The result of a future, once it is there.

    The system may hand Ctrl-C to another thread, which does not wake one that waits for a lock; so
    this one wakes now and then by itself, and then hears it.
    """
    while not future.done():
        wait([future], timeout=GLANCE)
    return future.result()


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Threads and processes that start meanwhile never hear Ctrl-C; this thread hears it later."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows: workers hear it until ``_begin``
        yield
        return
    resource_tracker.ensure_running()  # it would let interrupts through again when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(initializer: Callable[..., None] | None, *given: Any) -> None:
    """Prepare a worker: Ctrl-C is not for it, and SIGTERM ends it wherever it is.

    Pebble's own handler of SIGTERM is Python code, which complains where the process ends anyway.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if initializer is not None:
        initializer(*given)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)

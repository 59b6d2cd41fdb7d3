"""Trainings whose episodes are played in this process, which costs less."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, nullcontext
from types import ModuleType
from typing import Any

import pytest


class Workers:
    """Does at once what worker processes would do."""

    def schedule(
        self, work: Callable[..., Any], args: Sequence[Any] = (), timeout: float | None = None
    ) -> "Future[Any]":
        done: Future[Any] = Future()
        try:
            done.set_result(work(*args))
        except Exception as error:
            done.set_exception(error)
        return done


@contextmanager
def without_workers(trainer: ModuleType) -> Iterator[None]:
    """As long as the context, the runs of a trainer start no process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trainer, "working", lambda count: nullcontext(Workers()))
        yield

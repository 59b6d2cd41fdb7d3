"""What worker processes would do is done in this one, which costs less."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pytest

from benchmark.plumbing.errors import StoreError
from benchmark.records.record import Record
from benchmark.study import outcome
from benchmark.study.episode import Episode
from benchmark.study.pool import LocalPool


def _record(pool: LocalPool, episode: Episode) -> Record:
    try:
        return pool._work(episode)
    except StoreError:
        raise
    except Exception as error:  # as a worker does
        return outcome.raised(episode, error)


@contextmanager
def without_workers() -> Iterator[None]:
    """As long as the context, a pool of this machine runs its episodes here."""

    def run(pool: LocalPool, episodes: Sequence[Episode]) -> Iterator[tuple[Episode, Record]]:
        return ((episode, _record(pool, episode)) for episode in episodes)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LocalPool, "run", run)
        yield

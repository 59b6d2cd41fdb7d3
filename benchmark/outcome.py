"""What becomes of an episode that ended without a record of its own, wherever it ran."""

import logging
from collections.abc import Callable
from typing import Any

from benchmark.episode import Episode
from benchmark.errors import RightOfWayError
from benchmark.record import Record

LOG = logging.getLogger("rightofway.suite")
TIME_LIMIT = 600.0  # s of wall time for one try at an episode
TRIES = 2
Work = Callable[[Any], Record]
"""What is done with an episode, to its record: it is run, or the commands of its log are scored."""


def is_settled(record: Record) -> bool:
    """Whether to try again would be of no use: a controller's own fault comes again.

    An episode that crashed or took too long may be the victim of something else, such as a machine
    short of memory.
    """
    return record.status not in ("crashed", "timed out")


def log_retry(record: Record) -> None:
    """Say that an episode which came to this is tried once more."""
    LOG.info("tried again", extra={"facts": facts(record)})


def facts(record: Record) -> dict[str, object]:
    """What a line of a log says of a record."""
    names = {"scenario", "controller", "rate", "seed", "status", "reason", "wall_time", "identity"}
    return record.model_dump(mode="json", include=names)


def died(episode: Episode, how: str) -> Record:
    """The record of an episode whose process ended in the middle, in ``how`` with its signal."""
    return episode.record("crashed", reason=f"the worker process died ({how})")


def too_slow(episode: Episode, time_limit: float) -> Record:
    """The record of an episode that was stopped after the time limit [s]."""
    return episode.record("timed out", reason=f"not done after {time_limit:g} s")


def raised(episode: Episode, error: BaseException) -> Record:
    """The record of an episode whose run ended in an exception."""
    if isinstance(error, RightOfWayError):
        return episode.record("failed", reason=str(error))
    # SUMO's own errors in mid-episode, for one
    return episode.record("crashed", reason=f"{type(error).__name__}: {error}")

"""What becomes of an episode that ended without a record of its own, wherever it ran."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchmark.plumbing.errors import RightOfWayError
from benchmark.records.record import Record
from benchmark.study.episode import Episode

LOG = logging.getLogger("rightofway.suite")
TIME_LIMIT = 600.0  # s of wall time for one try at an episode
TRIES = 2
Work = Callable[[Any], Record]
"""What is done with an episode, to its record: it is run, or the commands of its log are scored."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of an episode, without its figures."""

    status: str
    reason: str | None = None
    refusals: tuple[str, ...] = ()  # the most frequent reasons why commands were refused

    @classmethod
    def of(cls, record: Record) -> "Outcome":
        """What a record says."""
        junctions = record.junctions.values()
        refusals = tuple(reason for junction in junctions for reason in junction.refusals)
        return cls(record.status, record.reason, refusals)

    @property
    def is_failure(self) -> bool:
        """Whether the episode should have had figures and has none."""
        return self.status not in ("ok", "skipped")


def is_settled(status: str) -> bool:
    """Whether to try again would be of no use: a controller's own fault comes again.

    An episode that crashed or took too long may be the victim of something else, such as a machine
    short of memory.
    """
    return status not in ("crashed", "timed out")


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

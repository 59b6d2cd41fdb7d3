"""Which episodes a results folder holds already, so that a suite goes on where it stopped."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from benchmark import action_log
from benchmark.episode import Episode
from benchmark.outcome import is_settled
from benchmark.record import Record, file_hash


def held(
    chosen: Sequence[Episode],
    records: Iterable[Record],
    actions: Path | None = None,
    is_shown: Callable[[Record], bool] | None = None,
) -> tuple[list[tuple[Episode, Record]], list[Episode]]:
    """The episodes that a folder holds, with their records, and those that are to be run.

    An episode is held when its newest record, the one that the leaderboard shows, has its identity
    and is settled: ``ok``, ``skipped`` or ``failed``. One that crashed or took too long is run
    again. Records from before identities were kept hold nothing.

    Args:
        chosen: what was asked for.
        records: of the folder, older ones first.
        actions: where action logs are; None where none are wanted. What ran well and lacks its
            log is run again.
        is_shown: whether a record has its replay; None where none are wanted. The same goes for it.
    """
    newest = {(one.episode, one.file_hash): one for one in records}
    found, waiting = [], []
    for episode in chosen:
        record = newest.get((episode.key, file_hash(episode.controller_from))) if newest else None
        if record and _counts(record, episode, actions, is_shown):
            found.append((episode, record))
        else:
            waiting.append(episode)
    return found, waiting


def _counts(
    record: Record,
    episode: Episode,
    actions: Path | None,
    is_shown: Callable[[Record], bool] | None,
) -> bool:
    if not is_settled(record) or record.identity != episode.identity:
        return False
    if record.status != "ok":
        return True
    return (actions is None or action_log.is_kept(actions, record)) and (
        is_shown is None or is_shown(record)
    )

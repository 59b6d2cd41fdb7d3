"""Which episodes a results folder holds already, so that a suite goes on where it stopped."""

from collections.abc import Iterable, Sequence

from benchmark.episode import Episode
from benchmark.outcome import is_settled
from benchmark.record import Record, file_hash


def held(
    chosen: Sequence[Episode], records: Iterable[Record]
) -> tuple[list[tuple[Episode, Record]], list[Episode]]:
    """The episodes that a folder holds, with their records, and those that are to be run.

    An episode is held when its newest record, the one that the leaderboard shows, has its identity
    and is settled: ``ok``, ``skipped`` or ``failed``. One that crashed or took too long is run
    again. Records from before identities were kept hold nothing.

    Args:
        chosen: what was asked for.
        records: of the folder, older ones first.
    """
    newest = {(one.episode, one.file_hash): one for one in records}
    found, waiting = [], []
    for episode in chosen:
        record = newest.get((episode.key, file_hash(episode.controller_from))) if newest else None
        if record and is_settled(record) and record.identity == episode.identity:
            found.append((episode, record))
        else:
            waiting.append(episode)
    return found, waiting

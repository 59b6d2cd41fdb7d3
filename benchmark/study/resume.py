"""Which episodes a results folder holds already, so that a suite goes on where it stopped."""

import json
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from benchmark.study.episode import Episode
from benchmark.study.outcome import Outcome, is_settled

if TYPE_CHECKING:
    import polars

KEYS = ("scenario", "scenario_hash", "controller", "rate", "seed")


def held(
    chosen: Sequence[Episode],
    table: "polars.DataFrame",
    is_kept: Callable[[Episode], bool] = lambda episode: True,
) -> tuple[list[tuple[Episode, Outcome]], list[Episode]]:
    """The episodes that a folder holds, with what became of them, and those that are to be run.

    An episode is held when its newest record, the one that the leaderboard shows, has its identity
    and is settled: ``ok``, ``skipped`` or ``failed``. One that crashed or took too long is run
    again. Records from before identities were kept hold nothing.

    Args:
        chosen: what was asked for.
        table: of the folder, as ``benchmark.records.table`` makes it.
        is_kept: whether what is wanted beside the record of an episode that ran well, such as its
            action log, is there; where not, it is run again.
    """
    if not len(table):
        return [], list(chosen)
    wanted = [one.identity for one in chosen]
    known = {
        tuple(key): Outcome(status, reason, tuple(json.loads(refusals or "[]")))
        for *key, status, reason, refusals in _newest(table, wanted).iter_rows()
    }
    found, waiting = [], []
    for episode, identity in zip(chosen, wanted, strict=True):
        outcome = known.get((*episode.key, identity))
        if outcome and is_settled(outcome.status) and (outcome.status != "ok" or is_kept(episode)):
            found.append((episode, outcome))
        else:
            waiting.append(episode)
    return found, waiting


def _newest(table: "polars.DataFrame", wanted: Sequence[str]) -> "polars.DataFrame":
    """The newest record of each episode, where its identity is among these."""
    from polars import col

    # files of one name lie side by side; of a package there is only the code that is installed
    file = col("controller_from").str.extract(r"(?s)\.py sha256:(.+)$", 1)
    ours = col("identity").is_in(wanted)
    return (
        table.lazy()
        .with_columns(file=file, ours=ours)
        .filter(col("ours").any().over("scenario"))  # most of a large folder is of others
        .filter(col("record") == col("record").max().over(*KEYS, "file"))
        .filter("ours")
        .select(*KEYS, "identity", "status", "reason", "refusals")
        .unique()
        .collect()
    )

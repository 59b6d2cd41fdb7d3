"""Which episodes a results folder holds already, so that a study goes on where it stopped."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.records.samples import EPISODE, newest
from benchmark.study import action_log
from benchmark.study.action_log import Key
from benchmark.study.episode import Episode
from benchmark.study.outcome import Outcome, is_settled

if TYPE_CHECKING:
    import polars


@dataclass(frozen=True)
class Keepsake:
    """Files that are wanted beside records, one for each episode that ends well."""

    folder: Path
    what: str  # they are, as in ``action logs``
    is_there: Callable[[Path, Key, str], bool]
    """Whether the folder has the file of an episode, by its key and identity."""


def action_logs(folder: Path) -> Keepsake:
    """Action logs in a folder of their own."""
    return Keepsake(folder, "action logs", action_log.has_log)


def kept_and_missing(
    episodes: Sequence[Episode], table: "polars.DataFrame", keepsakes: Sequence[Keepsake] = ()
) -> tuple[list[tuple[Episode, Outcome]], list[Episode]]:
    """The episodes that a folder holds, with what became of them, and those that are to be run.

    A folder holds an episode when its newest record, the one that the leaderboard shows, has the
    episode's identity and is settled: ``ok``, ``skipped`` or ``failed``. One that crashed or took
    too long is run again. Records from before identities were kept hold nothing.

    Args:
        episodes: what was asked for.
        table: of the folder, as ``benchmark.records.table`` makes it.
        keepsakes: what an episode that ended well has to have beside its record.
    """
    if not len(table):
        return [], list(episodes)
    identities = [episode.identity for episode in episodes]
    outcomes = {
        tuple(key): Outcome(status, reason, tuple(refusals or ()))
        for *key, status, reason, refusals in _newest(table, identities).iter_rows()
    }
    kept, missing = [], []
    for episode, identity in zip(episodes, identities, strict=True):
        outcome = outcomes.get((*episode.key, identity))
        if outcome and is_settled(outcome.status) and _has_all(episode, outcome, keepsakes):
            kept.append((episode, outcome))
        else:
            missing.append(episode)
    return kept, missing


def _has_all(episode: Episode, outcome: Outcome, keepsakes: Sequence[Keepsake]) -> bool:
    return outcome.status != "ok" or all(
        keepsake.is_there(keepsake.folder, episode.key, episode.identity) for keepsake in keepsakes
    )


def _newest(table: "polars.DataFrame", identities: Sequence[str]) -> "polars.DataFrame":
    """The newest record of each episode, where its identity is among these."""
    from polars import col

    # files of one name lie side by side; of a package there is only the code that is installed
    file = col("controller_from").str.extract(r"(?s)\.py sha256:(.+)$", 1)
    ours = col("identity").is_in(identities)
    table = table.with_columns(file=file, ours=ours)
    known = table.filter(col("ours").any().over("scenario"))  # most of a large folder is of others
    mine = newest(known, "file").filter("ours")
    return mine.select(*EPISODE, "identity", "status", "reason", "refusals").unique()

"""Records of earlier code get today's identity, where a sample of them comes out the same again.

Identities change with every edit of the code that determines episodes, also where no figure does.
A sample from every cell of a folder is run again; where all its figures are equal, to six digits,
the folder need not be run anew.
"""

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field

from benchmark.control.training import Training
from benchmark.records.record import Record
from benchmark.study.episode import Episode
from benchmark.study.executor import Executor
from benchmark.study.rescoring import contradictions

Key = tuple[str, str, str, float | None, int]  # ``Record.episode``
Place = tuple[str, str, str, float | None]
"""A cell: scenario, its hash, controller and rate."""

MADE_BY = frozenset({"controller_from"})  # names the version, so it differs where no figure does


@dataclass(frozen=True)
class Renewal:
    """What came of a sample."""

    identities: Mapping[Key, str]
    """Of the cells whose sample came out equal."""

    sampled: int
    trained_on: Mapping[Place, tuple[Training, ...] | None]
    """As controllers declare it now; records of before 0.4.0 do not say it."""

    differing: Mapping[Place, Sequence[str]] = field(default_factory=dict)
    """Cells where it did not, with the first differences."""

    def applied(self, record: Record) -> Record:
        """The record, with today's identity where its cell came out equal."""
        identity = self.identities.get(record.episode)
        if identity is None:
            return record
        trained_on = record.trained_on or self.trained_on[record.episode[:4]]
        return record.model_copy(update={"identity": identity, "trained_on": trained_on})


def sample_of(episodes: Iterable[Episode], seeds: int, draw: random.Random) -> list[Episode]:
    """Some episodes of every cell.

    Args:
        episodes: of a whole folder.
        seeds: how many of each cell.
        draw: chooses them.
    """
    cells: dict[Place, list[Episode]] = {}
    for episode in episodes:
        cells.setdefault(episode.key[:4], []).append(episode)
    return [
        episode for cell in cells.values() for episode in draw.sample(cell, min(seeds, len(cell)))
    ]


def renew(
    episodes: Sequence[Episode],
    sample: Sequence[Episode],
    records: Iterable[Record],
    executor: Executor,
    advance: Callable[[Episode, Record], None] = lambda episode, record: None,
) -> Renewal:
    """Run a sample again and compare it with the newest records.

    Args:
        episodes: of all records that may be renewed.
        sample: of these.
        records: of the folder, oldest first.
        executor: who runs the sample.
        advance: is told each episode that ends.

    Raises:
        RightOfWayError: an episode cannot be run at all.
    """
    newest = {record.episode: record for record in records}
    differing: dict[Place, list[str]] = {}
    trained_on = {}
    with closing(executor.run(sample)) as running:
        for episode, again in running:
            place, before = episode.key[:4], newest[episode.key]
            trained_on[place] = again.trained_on
            unsaid = {"trained_on"} if before.trained_on is None else set()
            if changes := contradictions(before, again, MADE_BY | unsaid):
                differing.setdefault(place, []).append(changes[0])
            advance(episode, again)
    identities = {
        episode.key: episode.identity for episode in episodes if episode.key[:4] not in differing
    }
    return Renewal(identities, len(sample), trained_on, differing)

"""Runs a study into a results folder: what is missing there, to the end or to Ctrl-C."""

import logging
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.commands import console, progress
from benchmark.plumbing.interrupts import Interrupts

if TYPE_CHECKING:
    from benchmark.records.store import Store
    from benchmark.study.episode import Episode
    from benchmark.study.episodes import Executor
    from benchmark.study.outcome import Outcome

LOG = logging.getLogger("rightofway.suite")


@dataclass
class Done:
    """What has become of a study."""

    results: "list[tuple[Episode, Outcome]]" = field(default_factory=list)
    """Of the folder and of this run."""

    interrupted: bool = False

    def words(self, wanted: int, folder: Path, *, force: bool) -> str:
        """What is there after an interrupt, and how to go on."""
        how = "without --force the same command runs only what has no record"
        if not force:
            how = "the same command goes on from there"
        return f"stopped; {len(self.results)} of {wanted} records are in {folder}; {how}"


def run(
    chosen: "Sequence[Episode]",
    executor: "Executor",
    store: "Store",
    *,
    force: bool = False,
    actions: Path | None = None,
    pages: Path | None = None,
) -> Done:
    """Run what a folder does not hold yet, the slowest first, and write each record as it ends.

    Args:
        chosen: all episodes of the study.
        executor: who runs them.
        store: where records are and go; nobody else writes there.
        force: also run what it holds.
        actions: a folder that action logs go to; an episode without its log is run again.
        pages: a folder that replays go to; the same goes for them.

    Raises:
        RightOfWayError: an episode cannot be prepared, or its record not written.
    """
    from benchmark.pictures.replay import replay
    from benchmark.study import action_log, cost, episodes, outcome, resume

    earlier = store.table(empty=True)
    is_kept = partial(_is_kept, actions=actions, pages=pages)
    held, waiting = ([], list(chosen)) if force else resume.held(chosen, earlier, is_kept)
    done = Done(held)
    if held:
        console.notice(
            f"{len(held)} of {len(chosen)} episodes are in {store.records_folder} already; "
            "--force runs them again"
        )
    if actions is not None:
        action_log.prepare(actions)
    if pages is not None:
        replay.prepare(pages)
    episodes.prepare(waiting)
    times = cost.estimates(waiting, earlier)
    del earlier  # it may be large
    ordered = cost.slowest_first(waiting, times)
    LOG.info("started", extra={"facts": {"episodes": len(waiting), "held": len(held)}})
    running = progress.run(executor, ordered, sorted(times, reverse=True))
    interrupts = Interrupts(lambda: _finish(executor))
    try:
        with interrupts, closing(running):
            for episode, record in running:
                with interrupts.held_back():  # what is written is counted
                    store.append(record)
                    done.results.append((episode, outcome.Outcome.of(record)))
                LOG.info("ended", extra={"facts": outcome.facts(record)})
                if interrupts.wanted:  # also where it was heard before anything ran
                    executor.drain()
    except KeyboardInterrupt:
        interrupts.wanted = True
    done.interrupted = interrupts.wanted and len(done.results) < len(chosen)
    failed = sum(one.is_failure for _, one in done.results)
    facts = {"records": len(done.results), "failed": failed, "interrupted": done.interrupted}
    LOG.info("stopped", extra={"facts": facts})
    return done


def _is_kept(episode: "Episode", *, actions: Path | None, pages: Path | None) -> bool:
    """Whether all that is wanted beside an episode's record is there."""
    from benchmark.pictures.replay import replay
    from benchmark.study import action_log

    return (actions is None or action_log.is_kept(actions, episode.key, episode.identity)) and (
        pages is None or replay.is_kept(pages, episode.key, episode.identity)
    )


def _finish(executor: "Executor") -> None:
    executor.drain()
    console.notice("finishing the running episodes; Ctrl-C again stops at once and loses them")

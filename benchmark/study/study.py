"""Runs a study into a results folder: what is missing there, to the end or to Ctrl-C."""

import logging
import multiprocessing
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.control.isolation import sandbox
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import isolated
from benchmark.plumbing.errors import StoreError, UsageError
from benchmark.plumbing.files import prepare_folder, writing
from benchmark.plumbing.interrupts import Interrupts
from benchmark.plumbing.processes import cores
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.study import cost, outcome, resume
from benchmark.study.episode import Episode
from benchmark.study.episodes import build_ahead, choose_episodes
from benchmark.study.executor import Executor
from benchmark.study.outcome import Outcome
from benchmark.study.pool import LocalPool
from benchmark.study.resume import Keepsake

if TYPE_CHECKING:
    from benchmark.records.leaderboard import Row

LOG = logging.getLogger("rightofway.suite")

Notice = Callable[[str], None]
"""Is told what the user should know."""

Advance = Callable[[Episode, Record], None]
Progress = Callable[[Sequence[Episode], Sequence[float]], AbstractContextManager[Advance]]
"""Shows how far a study is: it is told what will run and how long each takes [s], then each end."""


def silent(episodes: Sequence[Episode], times: Sequence[float]) -> AbstractContextManager[Advance]:
    """Show nothing."""
    return nullcontext(lambda episode, record: None)


@dataclass
class Study:
    """What has become of a study."""

    results: list[tuple[Episode, Outcome]] = field(default_factory=list)
    """Of the folder and of this run."""

    interrupted: bool = False
    """Whether Ctrl-C left episodes without a record."""

    rows: "list[Row]" = field(default_factory=list)
    """The leaderboard of the whole folder; empty after an interrupt."""


def run_study(
    what: str | Path | Sequence[str | Path] | Sequence[Episode],
    out: str | Path = "out",
    *,
    controllers: Sequence[str] = (),
    rates: Sequence[float] = (),
    seeds: int | Sequence[int] = (),
    workers: int | None = None,
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
    force: bool = False,
    executor: Executor | None = None,
    keepsakes: Sequence[Keepsake] = (),
    notice: Notice = print,
    progress: Progress = silent,
) -> Study:
    """Run episodes into a folder, which then holds their records and the leaderboard.

    What the folder holds already is not run again. Ctrl-C lets the running episodes end, a second
    one stops at once; the same call goes on from there.

    Worker processes import the script that calls this, so it calls it below
    ``if __name__ == "__main__":``.

    Args:
        what: scenarios as files, folders or shipped names, such as ``"334"``; or one suite, such
            as ``"paper"``; or episodes, which say themselves what is to be run.
        out: the results folder.
        controllers: names or files; none: the suite's, or all that are installed.
        rates: penetration rates; none: the suite's, or each scenario's own.
        seeds: the seeds 1 to a number, or these; none: the suite's, or each scenario's own.
        workers: processes side by side on this machine; None: one per core.
        isolate: whether controllers run in processes of their own; None: those not installed do.
        limits: of isolated controllers.
        force: whether to run also what the folder holds.
        executor: who runs the episodes, in place of ``workers``.
        keepsakes: what the executor writes beside records; an episode without is run again.
        notice: told what the user should know.
        progress: shows how far the study is.

    Raises:
        RightOfWayError: what is asked for is not there, cannot be run, or not be written.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):  # as multiprocessing asks
        raise UsageError(
            "run_study was called by a worker process that imports your script: call it below `if "
            '__name__ == "__main__":`'
        )
    names = [what] if isinstance(what, str | Path) else what
    episodes = [episode for episode in names if isinstance(episode, Episode)]
    if not episodes:
        episodes = choose_episodes(
            [str(name) for name in names],
            controllers,
            _checked_rates(rates),
            _seeds(seeds),
            isolate=isolate,
            limits=limits,
            notice=notice,
        )
    elif len(episodes) < len(names) or controllers or rates or seeds:
        raise UsageError("episodes say themselves what is to be run; give nothing beside them")
    _tell_what_isolation_lacks(episodes, notice)
    store = Store(Path(out), notice=notice)
    with store.writing():
        study = run_missing(
            episodes,
            executor or LocalPool(workers or cores()),
            store,
            force=force,
            keepsakes=keepsakes,
            notice=notice,
            progress=progress,
        )
        if not study.interrupted:
            study.rows = _write_leaderboard(store)
    return study


def _checked_rates(rates: Sequence[float]) -> Sequence[float]:
    for rate in rates:
        if not 0 <= rate <= 1:
            raise UsageError(f"rates: {rate:g}: expected a share from 0 to 1")
    return rates


def _seeds(seeds: int | Sequence[int]) -> Sequence[int]:
    seeds = range(1, seeds + 1) if isinstance(seeds, int) and seeds > 0 else seeds
    if isinstance(seeds, int) or any(seed < 0 for seed in seeds):
        raise UsageError(f"seeds = {seeds}: expected how many, as in 20, or each, as in [1, 2]")
    return seeds


def run_missing(
    episodes: Sequence[Episode],
    executor: Executor,
    store: Store,
    *,
    force: bool = False,
    keepsakes: Sequence[Keepsake] = (),
    notice: Notice = lambda message: None,
    progress: Progress = silent,
) -> Study:
    """Run what a folder does not hold yet, the slowest first, and write each record as it ends.

    Args:
        episodes: all of the study.
        executor: who runs them.
        store: where records are and go; nobody else writes there.
        force: also run what it holds.
        keepsakes: what the executor writes beside records; an episode without is run again.
        notice: told what the user should know.
        progress: shows how far the study is.

    Raises:
        RightOfWayError: an episode cannot be prepared, or its record not written.
    """
    kept, missing, times = _planned(episodes, store, keepsakes, notice, force=force)
    study = Study(kept)
    LOG.info("started", extra={"facts": {"episodes": len(missing), "held": len(kept)}})
    interrupts = Interrupts(lambda: _finish(executor, notice))
    try:
        with (
            interrupts,
            progress(missing, times) as advance,
            closing(executor.run(missing)) as running,
        ):
            for episode, record in running:
                with interrupts.held_back():  # what is written is counted
                    store.append(record)
                    study.results.append((episode, Outcome.of(record)))
                LOG.info("ended", extra={"facts": outcome.facts(record)})
                advance(episode, record)
                if interrupts.wanted:  # also where it was heard before anything ran
                    executor.drain()
    except KeyboardInterrupt:
        interrupts.wanted = True
    study.interrupted = interrupts.wanted and len(study.results) < len(episodes)
    failed = sum(end.is_failure for _, end in study.results)
    facts = {"records": len(study.results), "failed": failed, "interrupted": study.interrupted}
    LOG.info("stopped", extra={"facts": facts})
    return study


def _planned(
    episodes: Sequence[Episode],
    store: Store,
    keepsakes: Sequence[Keepsake],
    notice: Notice,
    *,
    force: bool,
) -> tuple[list[tuple[Episode, Outcome]], list[Episode], list[float]]:
    """What the folder holds, what is to be run, the slowest first, and how long each takes [s]."""
    earlier = store.table(empty=True)
    kept, missing = (
        ([], list(episodes)) if force else resume.kept_and_missing(episodes, earlier, keepsakes)
    )
    if kept:
        notice(
            f"{len(kept)} of {len(episodes)} episodes are in {store.records_folder} already; "
            "--force runs them again"
        )
    for keepsake in keepsakes:
        prepare_folder(keepsake.folder, keepsake.what)
    build_ahead(missing)
    times = cost.estimates(missing, earlier)
    return kept, cost.slowest_first(missing, times), sorted(times, reverse=True)


def _finish(executor: Executor, notice: Notice) -> None:
    executor.drain()
    notice("finishing the running episodes; Ctrl-C again stops at once and loses them")


def _tell_what_isolation_lacks(episodes: Sequence[Episode], notice: Notice) -> None:
    """Name what an isolated controller can do on this system all the same."""
    if any(isolated(episode.controller, episode.isolate) for episode in episodes):
        for deed in sandbox.missing():
            notice(f"on this system isolated controllers can {deed}")


def _write_leaderboard(store: Store) -> "list[Row]":
    """Write the leaderboard into a results folder, as Markdown and as CSV; its rows."""
    from benchmark.records import leaderboard
    from benchmark.reports import tables

    rows = leaderboard.rows_of(store.table())
    with writing(store.folder, "the leaderboard", StoreError, remedy=""):
        (store.folder / "LEADERBOARD.md").write_text(
            tables.leaderboard_markdown(rows), encoding="utf-8"
        )
        (store.folder / "leaderboard.csv").write_text(
            tables.leaderboard_csv(rows), encoding="utf-8"
        )
    return rows

"""The command ``rightofway reference``."""

import shlex
import sys
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console, failures
from benchmark.commands.choice import suite_named
from benchmark.commands.options import Workers
from benchmark.commands.progress import progress_bar
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.plumbing.git_state import GitState
    from benchmark.records.provenance import Provenance
    from benchmark.records.record import Record
    from benchmark.study.episode import Episode
    from benchmark.study.suite import Suite

app = typer.Typer(
    name="reference",
    help="The reference that `rightofway regress` compares with.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@app.callback()
def _root() -> None:  # with a callback, a single command keeps its name
    pass


@app.command()
def update(
    suite: Annotated[str, typer.Option(help="A suite's file or shipped name.")] = "regression",
    out: Annotated[Path, typer.Option(help="The reference's folder.")] = Path("results/reference"),
    workers: Workers = None,
    allow_dirty: Annotated[
        bool, typer.Option("--allow-dirty", help="Also where something is not committed.")
    ] = False,
    allow_failures: Annotated[
        bool, typer.Option("--allow-failures", help="Also where an episode is not ok.")
    ] = False,
) -> None:
    """Run a suite and make its records the reference; the old one stays until all is done."""
    from benchmark.plumbing.processes import cores
    from benchmark.records import reference
    from benchmark.study import outcome
    from benchmark.study.episodes import build_ahead, episodes_of
    from benchmark.study.pool import LocalPool

    declared = suite_named(suite)
    episodes = episodes_of(declared)
    reference.check_target(out)
    state = _git_state(out, allow_dirty)
    build_ahead(episodes)
    results: list[tuple[Episode, Record]] = []
    try:
        with (
            progress_bar(episodes) as advance,
            closing(LocalPool(workers or cores()).run(episodes)) as running,
        ):
            for episode, record in running:
                results.append((episode, record))
                advance(episode, record)
    except KeyboardInterrupt:
        console.notice(f"stopped; {out} is as it was")
        raise
    outcomes = [(episode, outcome.Outcome.of(record)) for episode, record in results]
    failures.report(outcomes, Path("out"), outcome.TIME_LIMIT)
    records = [record for _, record in results]
    failed = sum(record.is_failure for record in records)
    if failed and not allow_failures:
        console.notice(
            f"{failed} of {len(records)} episodes are not ok, which a check would take as "
            f"given from now on; nothing was written. --allow-failures writes to {out} all the same"
        )
        raise typer.Exit(1)
    reference.write_reference(out, records, _provenance(suite, declared, records, state))
    console.say(f"{out}: {len(records)} records")


def _git_state(out: Path, allow_dirty: bool) -> "GitState | None":
    """The commit that the reference will name.

    Raises:
        UsageError: something is not committed, and that was not allowed.
    """
    from benchmark.plumbing.git_state import git_state

    try:
        state = git_state(Path.cwd(), besides=out)
    except UsageError as error:
        if not allow_dirty:
            raise
        console.notice(f"{error}\nthe reference will name no commit")
        return None
    if state is None:
        console.notice("not in a git repository: the reference will name no commit")
    elif state.uncommitted and not allow_dirty:
        shown = ", ".join(state.uncommitted[:5])
        more = f" and {len(state.uncommitted) - 5} more" if len(state.uncommitted) > 5 else ""
        raise UsageError(
            f"not committed: {shown}{more}; a reference names the commit that made it, so commit "
            "or stash first, or give --allow-dirty"
        )
    return state


def _provenance(
    name: str, declared: "Suite", records: "Sequence[Record]", state: "GitState | None"
) -> "Provenance":
    from benchmark.records import provenance
    from benchmark.records.provenance import Git, Provenance

    git = Git(commit=state.commit, dirty=bool(state.uncommitted)) if state else None
    return Provenance(
        made=provenance.utc_now(),
        command=shlex.join(["rightofway", *sys.argv[1:]]),
        suite=name,
        suite_hash=provenance.hash_of(declared),
        episodes=len(records),
        records_hash="",  # of what is written, which is not yet
        platform=provenance.this_platform(),
        versions=provenance.versions_behind(records[0].versions),
        git=git,
    )

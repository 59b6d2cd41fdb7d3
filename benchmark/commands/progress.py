"""Runs episodes behind a progress bar."""

from collections.abc import Callable, Generator, Sequence
from typing import TYPE_CHECKING, Any

from benchmark.commands import console

if TYPE_CHECKING:
    from benchmark.episode import Episode
    from benchmark.record import Record


def run_all(
    chosen: "Sequence[Episode]", workers: int, work: "Callable[[Any], Record] | None" = None
) -> "Generator[Record, None, None]":
    """As ``benchmark.suite.run_all``, with a bar on standard error; close it to stop early."""
    from rich import progress

    from benchmark import episode, suite

    columns = (
        progress.TextColumn("{task.completed}/{task.total} episodes"),
        progress.BarColumn(),
        progress.TaskProgressColumn(),
        progress.TimeElapsedColumn(),
        progress.TextColumn("left"),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=console.stderr()) as bar:
        task = bar.add_task("", total=len(chosen))
        for record in suite.run_all(chosen, workers, work=work or episode.run):
            yield record
            bar.advance(task)

"""Shows how far a suite is while its episodes run."""

from collections.abc import Generator, Sequence
from contextlib import closing
from time import monotonic
from typing import TYPE_CHECKING

from benchmark.commands import console

if TYPE_CHECKING:
    from benchmark.records.record import Record
    from benchmark.study.episode import Episode
    from benchmark.study.episodes import Executor

Running = Generator[tuple["Episode", "Record"], None, None]


def run(
    executor: "Executor", episodes: "Sequence[Episode]", times: Sequence[float] | None = None
) -> Running:
    """As ``Executor.run``, with a line on standard error; close it to stop at once.

    Args:
        executor: who runs them.
        episodes: what is to be run.
        times: how long each will take [s], by which the time left is told; None: all as long.
    """
    from rich import progress

    if not episodes:
        return
    weights = dict(zip((one.key for one in episodes), times or [1.0] * len(episodes), strict=True))
    columns = (
        progress.TextColumn("{task.fields[done]}/{task.fields[all]} episodes"),
        progress.TextColumn("{task.fields[failed]} failed"),
        progress.TextColumn("{task.fields[rate]:.2g}/s"),
        progress.BarColumn(),
        progress.TaskProgressColumn(),
        progress.TimeElapsedColumn(),
        progress.TextColumn("left"),
        progress.TimeRemainingColumn(),
    )
    began, done, failed = monotonic(), 0, 0
    with (
        progress.Progress(*columns, console=console.stderr()) as bar,
        closing(executor.run(episodes)) as running,
    ):
        total = sum(weights.values())
        task = bar.add_task("", total=total, all=len(episodes), done=0, failed=0, rate=0.0)
        for episode, record in running:
            yield episode, record
            done, failed = done + 1, failed + record.is_failure
            rate = done / (monotonic() - began)
            bar.update(task, advance=weights[episode.key], done=done, failed=failed, rate=rate)

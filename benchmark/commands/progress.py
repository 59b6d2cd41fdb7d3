"""Shows how far a study is while its episodes run."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING

from benchmark.commands import console

if TYPE_CHECKING:
    from benchmark.records.record import Record
    from benchmark.study.episode import Episode


@contextmanager
def progress_bar(
    episodes: "Sequence[Episode]", times: Sequence[float] | None = None
) -> "Iterator[Callable[[Episode, Record], None]]":
    """A line on standard error; what it yields is called with each episode that ended.

    Args:
        episodes: what is to be run.
        times: how long each will take [s], by which the time left is told; None: all as long.
    """
    if not episodes:
        yield lambda episode, record: None
        return
    from rich import progress

    times = times or [1.0] * len(episodes)
    weights = {episode.key: time for episode, time in zip(episodes, times, strict=True)}
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
    with progress.Progress(*columns, console=console.stderr()) as bar:
        total = sum(weights.values())
        task = bar.add_task("", total=total, all=len(episodes), done=0, failed=0, rate=0.0)

        def advance(episode: "Episode", record: "Record") -> None:
            nonlocal done, failed
            done, failed = done + 1, failed + record.is_failure
            rate = done / (monotonic() - began)
            bar.update(task, advance=weights[episode.key], done=done, failed=failed, rate=rate)

        yield advance

"""Where a suite's episodes run: in processes of this machine, or on a cluster."""

import logging
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.commands import console
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.study.episodes import Executor
    from benchmark.study.outcome import Work


class Started(StrEnum):
    """Clusters that the command itself starts."""

    LOCAL = "local"


def executor(
    workers: int | None,
    time_limit: float,
    actions: Path | None = None,
    pages: Path | None = None,
    *,
    scheduler: str | None = None,
    scheduler_file: Path | None = None,
    cluster: Started | None = None,
) -> "Executor":
    """Who runs the episodes.

    Args:
        workers: processes side by side on this machine; None: one per core.
        time_limit: wall time for one try at an episode [s].
        actions: a folder that action logs go to; None: none are wanted.
        pages: a folder that replays go to; None: none are wanted.
        scheduler: the address of a Dask scheduler.
        scheduler_file: a file that holds it.
        cluster: starts one.

    Raises:
        UsageError: more than one place is named, workers for a cluster that has its own, or action
            logs or replays, which its workers would write where nobody looks.
        ClusterError: the file holds no address.
    """
    from benchmark.plumbing.processes import cores
    from benchmark.study.pool import LocalPool

    ways = {"--scheduler": scheduler, "--scheduler-file": scheduler_file, "--cluster": cluster}
    named = [way for way, value in ways.items() if value is not None]
    if len(named) > 1:
        raise UsageError(f"{' and '.join(named)} exclude each other; give one of them")
    if not named:
        return LocalPool(workers or cores(), time_limit, _work(actions, pages))
    for option, folder in (("--log-actions", actions), ("--record-trajectories", pages)):
        if folder is not None:
            raise UsageError(f"{option} is for episodes of this machine; leave out {named[0]}")

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters we say ourselves
    from benchmark.study.cluster import connection
    from benchmark.study.cluster.executor import Cluster

    if cluster is not None:
        connect = partial(connection.started_here, workers or cores())
        return Cluster(connect, time_limit, console.notice)
    if workers is not None:
        raise UsageError(f"--workers is for this machine; with {named[0]} the cluster's own run")
    address = connection.address_in(scheduler_file) if scheduler_file else scheduler or ""
    return Cluster(partial(connection.running, address), time_limit, console.notice)


def _work(actions: Path | None, pages: Path | None) -> "Work":
    """What a worker does with an episode."""
    from benchmark.pictures.replay import replay as playback
    from benchmark.study import episode, rescoring

    if pages is not None:
        return partial(playback.run_recorded, pages=pages, actions=actions)
    return partial(rescoring.run_logged, folder=actions) if actions else episode.run

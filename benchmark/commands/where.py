"""Where a suite's episodes run: in processes of this machine, or on a cluster."""

import logging
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.commands import console
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.study.executor import Executor
    from benchmark.study.outcome import Work
    from benchmark.study.resume import Keepsake


class Started(StrEnum):
    """Clusters that the command itself starts."""

    LOCAL = "local"


@dataclass(frozen=True)
class Beside:
    """What is written beside the records of a results folder."""

    keepsakes: "tuple[Keepsake, ...]"
    work: "Work"
    """Runs an episode and writes it."""

    options: tuple[str, ...]
    """By which it was asked for."""


def beside(out: Path, *, actions: bool, pages: bool) -> Beside:
    """What is to be written beside the records of a results folder.

    Args:
        out: the results folder.
        actions: whether action logs are wanted.
        pages: whether replays are.
    """
    from benchmark.study import action_log, episode, rescoring
    from benchmark.study.resume import Keepsake, action_logs

    work: Work = episode.run_episode
    keepsakes: tuple[Keepsake, ...] = ()
    options: tuple[str, ...] = ()
    logs = action_log.log_folder(out) if actions else None
    if logs is not None:
        work = partial(rescoring.run_logged, folder=logs)
        keepsakes, options = (action_logs(logs),), ("--log-actions",)
    if pages:
        from benchmark.pictures.replay.folder import folder_in, is_kept, run_recorded

        folder = folder_in(out)
        work = partial(run_recorded, pages=folder, actions=logs)
        keepsakes += (Keepsake(folder, "replays", is_kept),)
        options += ("--record-trajectories",)
    return Beside(keepsakes, work, options)


def executor(
    workers: int | None,
    time_limit: float,
    beside: Beside,
    *,
    scheduler: str | None = None,
    scheduler_file: Path | None = None,
    cluster: Started | None = None,
) -> "Executor":
    """Who runs the episodes.

    Args:
        workers: processes side by side on this machine; None: one per core.
        time_limit: wall time for one try at an episode [s].
        beside: what is written beside records.
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

    places = {"--scheduler": scheduler, "--scheduler-file": scheduler_file, "--cluster": cluster}
    named = [option for option, value in places.items() if value is not None]
    if len(named) > 1:
        raise UsageError(f"{' and '.join(named)} exclude each other; give one of them")
    if not named:
        return LocalPool(workers or cores(), time_limit, beside.work)
    for option in beside.options:
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

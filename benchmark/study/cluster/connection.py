"""Ways to a Dask cluster: one that runs somewhere, or one that is started here."""

import asyncio
import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.plumbing.errors import ClusterError
from benchmark.plumbing.processes import interrupts_held_back

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

PATIENCE = 10.0  # s for a scheduler to answer
ONE_EACH = {"distributed.scheduler.worker-saturation": 1.0}  # none waits behind one that hangs


def address_in(file: Path) -> str:
    """The address in a file that ``dask scheduler --scheduler-file`` writes.

    Raises:
        ClusterError: it cannot be read, or holds no address.
    """
    try:
        found = json.loads(file.read_text())["address"]
    except OSError as error:
        raise ClusterError(
            f"{file}: cannot read the scheduler file: {error.strerror}; "
            "`dask scheduler --scheduler-file` writes it"
        ) from error
    except (ValueError, KeyError, TypeError) as error:
        raise ClusterError(
            f'{file}: expected what `dask scheduler --scheduler-file` writes, with an "address"'
        ) from error
    return str(found)


@contextmanager
def running(address: str) -> Iterator["Client"]:
    """A client of the cluster whose scheduler listens at an address, as in ``tcp://host:8786``.

    Raises:
        ClusterError: it is no address, or nobody answers there.
    """
    _require_dask()
    from distributed import Client

    try:
        asyncio.run(asyncio.wait_for(_ask(address), PATIENCE))
        client = Client(address, timeout=PATIENCE, set_as_default=False, name="rightofway")
    except ValueError as error:
        raise ClusterError(
            f'"{address}" is no address of a Dask scheduler; expected one such as '
            "tcp://host:8786, which `dask scheduler` prints"
        ) from error
    except OSError as error:
        raise ClusterError(
            f"{address}: no Dask scheduler answers there within {PATIENCE:g} s; is it running, "
            "and can it be reached from here?"
        ) from error
    with client:
        yield client


async def _ask(address: str) -> None:
    """Ask a scheduler who it is; a client would wait for one that listens and says nothing.

    Raises:
        ValueError: it is no address.
        OSError: nobody is there.
    """
    from distributed import rpc
    from distributed.comm.addressing import get_address_host_port
    from distributed.security import Security

    get_address_host_port(address)
    async with rpc(address, connection_args=Security().get_connection_args("client")) as scheduler:
        await scheduler.identity()


@contextmanager
def started_here(workers: int) -> Iterator["Client"]:
    """A client of a cluster of this machine, which ends with the context.

    Args:
        workers: how many, each with one episode at a time.

    Raises:
        ClusterError: Dask is not installed.
    """
    with local(workers) as cluster, running(cluster.scheduler_address) as client:
        yield client


def local(workers: int) -> "LocalCluster":
    """A cluster of this machine, heard by nobody outside.

    Args:
        workers: how many processes, each with one episode at a time.

    Raises:
        ClusterError: Dask is not installed.
    """
    _require_dask()
    import dask
    from distributed import LocalCluster

    with (
        interrupts_held_back(),  # Ctrl-C is this process's to answer, and not its workers'
        dask.config.set(ONE_EACH),
    ):
        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",  # the usual port may be another cluster's
            memory_limit=0,  # episodes have processes of their own
            silence_logs=logging.CRITICAL,
        )


def _require_dask() -> None:
    try:
        import distributed  # noqa: F401 - only whether it is there
    except ImportError as error:
        raise ClusterError(
            "to run episodes on a cluster takes Dask, which is not installed; "
            "pip install 'rightofway[cluster]'"
        ) from error

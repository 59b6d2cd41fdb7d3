"""Clusters that cannot be reached are refused, and one that comes back goes on."""

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import pytest
from factories.episodes import GOOD, lines
from factories.processes import PATIENCE, wait_for, worker_of

from benchmark.plumbing.errors import ClusterError
from benchmark.study.cluster import connection
from benchmark.study.cluster.executor import Cluster
from benchmark.study.episode import run_episode


@pytest.mark.parametrize("address", ["", "host", "tcp://host", "http://host:1", "tcp://a:b"])
def test_what_is_no_address_is_refused(address: str) -> None:
    with pytest.raises(ClusterError, match=f'"{address}" is no address .* tcp://host:8786'):
        next(Cluster(partial(connection.running, address)).run(GOOD))


def test_an_address_where_nobody_answers_is_refused_in_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(connection, "PATIENCE", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as deaf:  # it takes the connection and says nothing
        address = f"tcp://127.0.0.1:{deaf.getsockname()[1]}"
        began = time.monotonic()
        with pytest.raises(ClusterError, match=f"{address}: no Dask scheduler answers"):
            next(Cluster(partial(connection.running, address)).run(GOOD))
    assert time.monotonic() - began < PATIENCE


@pytest.mark.parametrize("text", ["{}", "[]", "no JSON", '"tcp://host:1"'])
def test_a_scheduler_file_without_an_address_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "scheduler.json"
    file.write_text(text)
    with pytest.raises(ClusterError, match=f'{file}: expected .* with an "address"'):
        connection.address_in(file)


def test_a_scheduler_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ClusterError, match=r"none\.json: cannot read the scheduler file: No such"):
        connection.address_in(tmp_path / "none.json")


def test_without_dask_a_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClusterError, match=r"pip install 'rightofway\[cluster\]'"):
        next(Cluster(partial(connection.started_here, 1)).run(GOOD))


@contextmanager
def dask_scheduler(port: int) -> Iterator[subprocess.Popen[bytes]]:
    """A scheduler's process."""
    script = "from distributed.cli.dask_scheduler import main; main()"
    options = ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    process = subprocess.Popen([sys.executable, "-c", script, *options], stderr=subprocess.DEVNULL)
    try:
        wait_for(lambda: listens(port))
        yield process
    finally:
        process.kill()
        process.wait(PATIENCE)


def listens(port: int) -> bool:
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])


def test_a_scheduler_that_dies_ends_the_suite_with_a_message() -> None:
    address = f"tcp://127.0.0.1:{(port := free_port())}"
    with dask_scheduler(port) as process:
        cluster = Cluster(
            partial(connection.running, address), notice=lambda message: process.kill()
        )
        with pytest.raises(ClusterError, match=f"the scheduler {address} is gone"):
            next(cluster.run(GOOD))


def test_a_scheduler_that_comes_back_is_given_its_episodes_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(connection, "PATIENCE", PATIENCE)
    address = f"tcp://127.0.0.1:{(port := free_port())}"
    with ExitStack() as processes:
        first = processes.enter_context(dask_scheduler(port))

        def replace(message: str) -> None:
            threading.Timer(0.5, restart).start()

        def restart() -> None:
            first.kill()
            first.wait(PATIENCE)
            processes.enter_context(dask_scheduler(port))
            processes.enter_context(worker_of(address))

        cluster = Cluster(partial(connection.running, address), notice=replace)
        found = list(cluster.run(GOOD))
    assert lines(record for _, record in found) == lines(map(run_episode, GOOD))

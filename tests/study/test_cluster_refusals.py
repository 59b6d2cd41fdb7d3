"""Workers that would give other records, and clusters that cannot be reached, are refused."""

import os
import platform
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pytest
from factories.episodes import GOOD, lines
from factories.processes import kill, pid_in, wait_for
from factories.scenarios import smoke
from plugins import install

from benchmark import __version__
from benchmark.control import plugins
from benchmark.plumbing.errors import ClusterError
from benchmark.study.cluster import connection, environment
from benchmark.study.cluster.executor import Cluster
from benchmark.study.episode import Episode, run

COMMAND = [
    *(
        sys.executable,
        "-c",
        "from benchmark.commands.app import main; main()",
        "run",
        "smoke/crossing",
    ),
    *("--controller", "virtual-signal", "--seed", "1"),
]
WITHOUT_US = "import sys; sys.modules['benchmark'] = None; "
DASK_WORKER = "from distributed.cli.dask_worker import main; main()"


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Path]:
    """Where the hostile controllers are installed, here and in worker processes."""
    with pytest.MonkeyPatch.context() as patch:
        place = install(tmp_path / "site")
        patch.syspath_prepend(place)
        plugins.discovered.cache_clear()
        yield place
    plugins.discovered.cache_clear()


@pytest.fixture
def scheduler(site: Path) -> Iterator[distributed.LocalCluster]:
    with connection.local(0) as cluster:
        yield cluster


@contextmanager
def worker_of(address: str, *first: Path, script: str = DASK_WORKER) -> Iterator[None]:
    """A worker's process with folders first on its path, as long as the context."""
    path = os.pathsep.join(map(str, [*first, *sys.path]))
    options = ["--nthreads", "1", "--no-dashboard", "--no-nanny"]
    process = subprocess.Popen(
        [sys.executable, "-c", script, address, *options],
        env={**os.environ, "PYTHONPATH": path},
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.kill()
        process.wait()


@contextmanager
def joined(cluster: Any, *first: Path, script: str = DASK_WORKER) -> Iterator[str]:
    """The same, when it has joined a cluster of this process; its address."""
    before = set(cluster.scheduler.workers)
    with worker_of(cluster.scheduler_address, *first, script=script):
        wait_for(lambda: len(cluster.scheduler.workers) > len(before))
        (address,) = set(cluster.scheduler.workers) - before
        yield address


def older_numpy(folder: Path) -> Path:
    """A folder that makes numpy look older than it is."""
    info = folder / "numpy-0.0.1.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 0.0.1\n")
    return folder


def on(cluster: Any) -> Cluster:
    return Cluster(partial(connection.running, cluster.scheduler_address))


# --- workers ------------------------------------------------------------------------------------


def test_a_worker_of_another_version_is_refused_by_name_before_anything_runs(
    scheduler: Any, tmp_path: Path
) -> None:
    file = tmp_path / "scheduler.json"
    file.write_text(f'{{"address": "{scheduler.scheduler_address}"}}')
    with joined(scheduler, older_numpy(tmp_path / "old")) as address:
        done = subprocess.run(
            [*COMMAND, "--scheduler-file", str(file), "--out", str(tmp_path / "out")],
            capture_output=True,
            text=True,
        )
    assert done.returncode == 2
    assert f"worker {address}: numpy is 0.0.1 there and {np.__version__} here" in done.stderr
    assert "Traceback" not in done.stderr
    assert not list((tmp_path / "out").rglob("*.jsonl"))


def test_a_worker_that_joins_later_is_refused_too_and_loses_nobodys_episode(
    scheduler: Any, site: Path, tmp_path: Path
) -> None:
    marker = tmp_path / "marker"
    long = Episode(smoke("crossing"), f"hangs-once?marker={marker}", 0.5, 1)

    def end(victim: int) -> None:
        wait_for(lambda: len(scheduler.scheduler.tasks) == 1)  # the rest is refused and dropped
        kill(victim)

    running = on(scheduler).run([GOOD[0], long, *GOOD[1:]])
    with joined(scheduler, site):
        ended = [next(running)[1]]
        victim = pid_in(marker)  # the good worker has this to do, and the rest is the bad one's
        with joined(scheduler, older_numpy(tmp_path / "old"), site) as bad:
            threading.Thread(target=end, args=(victim,)).start()
            with pytest.raises(ClusterError) as refusal:
                ended.extend(record for _, record in running)  # each as it comes
    assert f"worker {bad}: numpy is 0.0.1 there" in str(refusal.value)
    assert [one.status for one in ended] == ["ok", "ok"]
    assert ended[1].controller == long.label


def test_a_worker_without_right_of_way_is_refused_whenever_it_joins(scheduler: Any) -> None:
    told: list[str] = []
    with ExitStack() as workers:

        def join(message: str) -> None:
            told.append(message)
            workers.enter_context(joined(scheduler, script=WITHOUT_US + DASK_WORKER))

        cluster = Cluster(partial(connection.running, scheduler.scheduler_address), notice=join)
        for _ in range(2):
            with pytest.raises(ClusterError, match=f"cannot load rightofway {__version__}"):
                next(cluster.run(GOOD))
    assert told == ["the cluster has no workers yet; waiting for some"]  # the second time it has


# --- what must be the same ----------------------------------------------------------------------


def test_this_process_is_as_it_is() -> None:
    wanted = environment.needed(["virtual-signal", "wang?greedy=1", "traffic-light"])
    assert wanted["version", "numpy"] == np.__version__
    assert {name for kind, name in wanted if kind == "code"} == {"benchmark", "baselines"}
    assert ("version", "torch") not in wanted  # no controller that ships computes with it
    assert environment.differences(wanted) == []


def test_what_others_controllers_need_must_be_the_same(site: Path) -> None:
    wanted = environment.needed(["hangs"])
    assert wanted["controller", "hangs"] == "of hostile 1.0.0"
    assert {"hostile", "benchmark"} == {name for kind, name in wanted if kind == "code"}
    assert ("version", "torch") in wanted
    (site / "hostile.py").write_text("pass")
    others = {("version", "numpy"): "0.0.1", ("version", "no-such"): "1", ("Python", ""): "2.7"}
    assert environment.differences({**wanted, **others}) == [
        f"Python is {platform.python_version()} there and 2.7 here",
        f"numpy is {np.__version__} there and 0.0.1 here",
        "no-such is missing there and 1 here",
    ]


# --- clusters -----------------------------------------------------------------------------------


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
    assert time.monotonic() - began < 5


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
        process.wait()


def listens(port: int) -> bool:
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])


def test_a_scheduler_that_dies_ends_the_suite_with_a_message(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(connection, "PATIENCE", 1.5)
    address = f"tcp://127.0.0.1:{(port := free_port())}"
    with dask_scheduler(port) as process:
        cluster = Cluster(
            partial(connection.running, address), notice=lambda message: process.kill()
        )
        with pytest.raises(ClusterError, match=f"the scheduler {address} is gone"):
            next(cluster.run(GOOD))


def test_a_scheduler_that_comes_back_is_given_its_episodes_again() -> None:
    address = f"tcp://127.0.0.1:{(port := free_port())}"
    with ExitStack() as processes:
        first = processes.enter_context(dask_scheduler(port))

        def replace(message: str) -> None:
            threading.Timer(0.5, restart).start()

        def restart() -> None:
            first.kill()
            first.wait()
            processes.enter_context(dask_scheduler(port))
            processes.enter_context(worker_of(address))

        cluster = Cluster(partial(connection.running, address), notice=replace)
        found = list(cluster.run(GOOD))
    assert lines(record for _, record in found) == lines(map(run, GOOD))

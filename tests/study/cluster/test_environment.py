"""Workers that would give other records are refused by name."""

import platform
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pytest
from factories.episodes import GOOD
from factories.processes import DASK_WORKER, PATIENCE, kill, pid_in, wait_for, worker_of
from factories.scenarios import smoke
from plugins import install

from benchmark import __version__
from benchmark.control import plugins
from benchmark.plumbing.errors import ClusterError
from benchmark.study.cluster import connection, environment
from benchmark.study.cluster.executor import Cluster
from benchmark.study.episode import Episode

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
            timeout=PATIENCE,
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

"""Episodes on a Dask cluster: real schedulers, workers that are really killed."""

import os
import signal
import subprocess
import sys
import threading
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest
from distributed import Client, LocalCluster
from factories.command_line import rightofway
from factories.episodes import GOOD, lines
from factories.processes import PATIENCE, kill, pid_in, wait_for
from factories.scenarios import smoke
from factories.workers import without_workers

from benchmark.plumbing.errors import ClusterError
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.study import identity
from benchmark.study.cluster import connection, stream
from benchmark.study.cluster.executor import Cluster
from benchmark.study.episode import Episode, run_episode
from benchmark.study.pool import LocalPool

pytestmark = pytest.mark.usefixtures("hostile")

SHORT = Episode(smoke("crossing"), "virtual-signal", 0.5, 1)
COMMAND = [
    sys.executable,
    "-c",
    "from benchmark.commands.app import main; main()",
    "run",
    "smoke/crossing",
]


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalCluster]:
    """Two worker processes that share nothing with this one but the disk, not even the cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIGHTOFWAY_CACHE", str(tmp_path_factory.mktemp("cache")))
        cluster = connection.local(2)
    with cluster:
        yield cluster


def on(cluster: LocalCluster, **options: Any) -> Cluster:
    return Cluster(partial(connection.running, cluster.scheduler_address), **options)


def test_records_are_those_of_this_process_bit_for_bit(dask: LocalCluster) -> None:
    chosen = [*GOOD, Episode(smoke("tee"), "traffic-light", None, 1)]
    found = list(on(dask).run(chosen))
    assert lines(record for _, record in found) == lines(map(run_episode, chosen))
    assert [record.episode for _, record in found] == [episode.key for episode, _ in found]


@pytest.mark.parametrize("isolate", [True, False])
def test_a_controllers_file_travels_and_keeps_its_name_and_hash(
    dask: LocalCluster, tmp_path: Path, isolate: bool
) -> None:
    """What lies beside it travels too: a module where it is not isolated, and weights."""
    file, beside = tmp_path / "mine.py", f"beside_{uuid.uuid4().hex}"
    (tmp_path / f"{beside}.py").write_text("from baselines.virtual_signal import VirtualSignal\n")
    (tmp_path / "mine.npy").write_bytes(b"10")
    file.write_text(BESIDE.format(module="baselines.virtual_signal" if isolate else beside))
    episode = Episode(smoke("crossing"), f"{file}:Mine?green=7", 0.5, 1, isolate=isolate)
    expected = run_episode(episode)
    assert (expected.status, expected.reason) == ("ok", None)

    @contextmanager
    def elsewhere() -> Iterator[Client]:
        with connection.running(dask.scheduler_address) as client:
            file.write_text("raise RuntimeError")  # as on a machine with another such file
            yield client

    (found,) = Cluster(elsewhere).run([episode])
    assert lines([found[1]]) == lines([expected])
    assert str(found[1].controller_from).startswith("mine.py sha256:")


BESIDE = """
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.append(str(HERE))
from {module} import VirtualSignal


class Mine(VirtualSignal):
    def __init__(self, green: float):
        super().__init__(green + int((HERE / "mine.npy").read_text()))
"""


def test_what_is_too_large_to_travel_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("")
    (tmp_path / "mine.safetensors").write_bytes(b"x" * 2_000_001)
    episode = Episode(smoke("crossing"), f"{tmp_path / 'mine.py'}:Mine", 0.5, 1)

    @contextmanager
    def never() -> Iterator[Client]:
        raise AssertionError
        yield

    with pytest.raises(ClusterError, match=r"it has 2.0 MB, and at most 2 MB travel"):
        next(Cluster(never).run([episode]))


def test_a_record_made_of_other_files_is_not_taken(
    dask: LocalCluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        identity, "identity_of", lambda **_: "of other files, in this process alone"
    )
    with pytest.raises(ClusterError, match="ran virtual-signal with other files than are here"):
        list(on(dask).run([SHORT]))


def test_what_goes_wrong_in_an_episode_is_recorded_as_on_this_machine(dask: LocalCluster) -> None:
    before = dask_workers(dask)
    hangs, crashes, raises = (
        Episode(smoke("crossing"), name, 0.5, 1) for name in ("hangs", "crashes", "raises-in-act")
    )
    ((_, slow),) = on(dask, time_limit=1.0).run([hangs])
    assert (slow.status, slow.reason) == ("timed out", "not done after 1 s")
    found = [record for _, record in on(dask).run([crashes, raises])]
    here = [record for _, record in LocalPool(2).run([crashes, raises])]
    assert {one.status for one in here} == {"crashed", "failed"}
    assert lines(found) == lines(here)
    assert dask_workers(dask) == before  # it cost no Dask worker its life


def test_a_dask_worker_killed_in_mid_episode_costs_nothing_but_time(
    dask: LocalCluster, tmp_path: Path
) -> None:
    marker = tmp_path / "marker"
    doomed = Episode(smoke("crossing"), f"hangs-once?marker={marker}", 0.5, 1)
    found = []
    for _, record in on(dask).run([doomed, *GOOD]):
        found.append(record)
        if len(found) == len(GOOD):  # the other worker has ended all of these meanwhile
            kill(psutil.Process(pid_in(marker)).ppid())
    assert lines(found) == lines(map(run_episode, [doomed, *GOOD]))


def test_an_episode_that_takes_its_dask_workers_along_has_crashed_and_no_other(
    tmp_path: Path,
) -> None:
    file = tmp_path / "assassin.py"
    file.write_text(ASSASSIN)
    doomed = Episode(smoke("crossing"), f"{file}:Assassin", 0.5, 1, isolate=False)
    with connection.local(1) as cluster:
        cluster.scheduler.allowed_failures = 0
        found = [record for _, record in on(cluster).run([doomed, *GOOD[:2]])]
    crashed, *good = sorted(found, key=lambda one: one.controller != doomed.label)
    assert (crashed.controller, crashed.status) == (doomed.label, "crashed")
    assert crashed.reason == "the worker process died (and 1 Dask workers with it)"
    assert lines(good) == lines(map(run_episode, GOOD[:2]))


ASSASSIN = """
import os
import signal

from benchmark.control.controller import Controller


class Assassin(Controller):
    def reset(self, intersection, seed):
        self.parent = os.getppid()

    def act(self, state):
        os.kill(self.parent, signal.SIGKILL)
        os._exit(1)  # or it would go on, as the child of whoever takes it in
"""


def test_to_drain_ends_with_the_episodes_under_way(dask: LocalCluster, tmp_path: Path) -> None:
    first, second = (
        Episode(smoke("crossing"), f"hangs-once?marker={tmp_path / name}", 0.5, 1)
        for name in ("first", "second")
    )
    cluster, ended = on(dask), []

    def follow() -> None:
        ended.extend(record.controller for _, record in cluster.run([first, second, *GOOD * 4]))

    following = threading.Thread(target=follow)
    following.start()
    victims = [pid_in(tmp_path / name) for name in ("first", "second")]
    cluster.drain()
    wait_for(lambda: len(dask.scheduler.tasks) == 2)  # the rest has been dropped
    for pid in victims:
        kill(pid)
    following.join(PATIENCE)
    assert sorted(ended) == [first.label, second.label]


def test_to_close_stops_the_episodes_under_way_on_the_workers(
    dask: LocalCluster, tmp_path: Path
) -> None:
    marker = tmp_path / "marker"
    running = on(dask).run([SHORT, Episode(SHORT.scenario, f"hangs-once?marker={marker}", 0.5, 1)])
    next(running)
    process = psutil.Process(pid_in(marker))
    running.close()
    process.wait(PATIENCE)


def test_a_command_that_is_killed_leaves_nothing_running_on_the_workers(
    dask: LocalCluster, tmp_path: Path
) -> None:
    marker = tmp_path / "marker"
    command = subprocess.Popen(
        [
            *(*COMMAND, "--controller", f"hangs-once?marker={marker}", "--seed", "1"),
            *("--scheduler", dask.scheduler_address, "--out", str(tmp_path / "out")),
        ],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        stderr=subprocess.DEVNULL,
    )
    process = psutil.Process(pid_in(marker))
    command.kill()
    command.wait(PATIENCE)
    process.wait(PATIENCE)


STUDY = ["--controller", "virtual-signal", "--controller", "traffic-light", "--seeds", "20"]


def test_no_more_calls_are_under_way_than_there_is_room_for_and_each_ends_once(
    dask: LocalCluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "LEAST", 3)
    ended: list[tuple[int, Any]] = []
    waiting, most = list(range(40)), 0
    with connection.running(dask.scheduler_address) as client:
        calls: stream.Stream[int] = stream.Stream(client, divmod)
        while waiting or len(calls):
            while waiting and calls.has_room():
                item = waiting.pop()
                calls.submit(item, 100, item)
            most = max(most, len(calls))
            ended += calls.ended()
    assert most == 2 * stream.PER_THREAD
    assert sorted(item for item, _ in ended) == list(range(40))
    for item, result in ended:
        if item:
            assert result == divmod(100, item)
        else:
            assert isinstance(result, ZeroDivisionError)


def test_ctrl_c_on_a_cluster_of_this_machine_finishes_what_runs_and_the_suite_goes_on_without_it(
    tmp_path: Path,
) -> None:
    running = subprocess.Popen(
        [*COMMAND, *STUDY, "--workers", "2", "--out", str(tmp_path), "--cluster", "local"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        text=True,
    )
    wait_for(lambda: any(path.stat().st_size for path in tmp_path.rglob("*.jsonl")))
    os.killpg(running.pid, signal.SIGINT)  # as a terminal does, to all of its processes
    said = running.communicate(timeout=PATIENCE)[1]
    assert running.returncode == 130, said
    assert "the same command goes on from there" in said
    assert "Traceback" not in said
    before = records_in(tmp_path)
    assert 0 < len(before) < 40
    assert {one.status for one in before} == {"ok"}
    with without_workers():  # elsewhere
        again = rightofway(tmp_path, "run", "smoke/crossing", *STUDY, "--out", tmp_path)
    assert again.returncode == 0, again.stderr
    assert len(lines(records_in(tmp_path))) == len(records_in(tmp_path)) == 40


def records_in(folder: Path) -> list[Record]:
    return Store(folder).read()


def dask_workers(cluster: LocalCluster) -> set[int]:
    return {one.pid for one in cluster.workers.values()}

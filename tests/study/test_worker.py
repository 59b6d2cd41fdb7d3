"""Worker processes that die, hang or leak, as they do in long suites: real ones, really killed."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from factories.processes import PATIENCE, pid_in, wait_for
from factories.scenarios import smoke

from benchmark.study import worker as supervised
from benchmark.study.episode import Episode, run_episode
from benchmark.study.pool import LocalPool
from benchmark.study.worker import Worker

pytestmark = pytest.mark.usefixtures("hostile")

SHORT = Episode(smoke("crossing"), "virtual-signal", 0.5, 1)


@pytest.fixture
def worker(tmp_path: Path) -> Iterator[Worker]:
    one = Worker(str(tmp_path), time_limit=60.0)
    yield one
    one.close()


def processes() -> set[int]:
    """The worker processes of this one."""
    found = set()
    for child in psutil.Process().children():
        with suppress(psutil.Error):  # it has just ended
            if "spawn_main" in " ".join(child.cmdline()):
                found.add(child.pid)
    return found


def once(tmp_path: Path, name: str = "marker") -> tuple[Episode, Path]:
    """An episode that hangs the first time, and the file that says in which process."""
    marker = tmp_path / name
    return Episode(smoke("crossing"), f"hangs-once?marker={marker}", 0.5, 1), marker


def equal(one: object, other: object) -> bool:
    """Whether two records are the same but for their wall time."""
    return one.model_copy(update={"wall_time": 0.0}) == other.model_copy(update={"wall_time": 0.0})  # type: ignore[attr-defined]


def test_a_worker_killed_in_mid_episode_costs_a_second_try_and_nothing_else(
    tmp_path: Path,
) -> None:
    doomed, marker = once(tmp_path)
    good = [Episode(smoke("crossing"), "virtual-signal", 0.5, seed) for seed in range(4)]
    running = LocalPool(2).run([doomed, *good])
    records = {}
    for episode, record in running:  # the other worker ends all of these meanwhile
        records[episode.seed, episode.controller] = record
        if len(records) == len(good):
            os.kill(pid_in(marker), signal.SIGKILL)
    assert {one.status for one in records.values()} == {"ok"}
    assert len(records) == 5
    assert equal(records[0, "virtual-signal"], run_episode(good[0]))
    assert equal(records[1, doomed.controller], run_episode(doomed))


def test_a_worker_is_used_again_and_replaced_where_it_died_between_two_episodes(
    worker: Worker,
) -> None:
    assert worker.run(SHORT).status == "ok"
    (first,) = processes()
    assert worker.run(SHORT).status == "ok"
    assert processes() == {first}
    os.kill(first, signal.SIGKILL)
    wait_for(lambda: first not in processes())  # it is its pool's to wait for it
    assert worker.run(SHORT).status == "ok"
    assert first not in processes()


def test_a_worker_that_dies_just_as_it_is_given_an_episode_loses_none(worker: Worker) -> None:
    """At moments spread over the first milliseconds of an episode."""
    for delay in (0.0, 0.005, 0.02):
        assert worker.run(SHORT).status == "ok"
        (pid,) = processes()
        murderer = threading.Timer(delay, os.kill, (pid, signal.SIGKILL))
        murderer.start()
        assert worker.run(SHORT).status == "ok"
        murderer.join(PATIENCE)


def test_a_stopped_process_times_out_and_the_next_episode_gets_another(
    tmp_path: Path,
) -> None:
    slow = Worker(str(tmp_path), time_limit=20.0)  # s; enough to start and run on any machine
    try:
        assert slow.run(SHORT).status == "ok"
        (pid,) = processes()
        os.kill(pid, signal.SIGSTOP)  # asleep, as on a machine that swaps
        assert slow.run(SHORT).status == "ok"
        assert pid not in processes()
    finally:
        slow.close()


def test_a_controllers_own_fault_is_not_tried_again_and_what_it_left_behind_is_gone(
    worker: Worker, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "rightofway")
    assert worker.run(Episode(smoke("crossing"), "raises-in-act", 0.5, 1)).status == "failed"
    assert not processes()
    assert not caplog.records
    assert worker.run(Episode(smoke("crossing"), "crashes", 0.5, 1)).status == "crashed"
    assert [one.message for one in caplog.records] == ["tried again"]


def test_a_worker_that_has_grown_is_replaced(
    worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervised, "LEAK", 512.0)
    leaks = Episode(smoke("crossing"), "devours?megabytes=10", 0.5, 1)
    assert worker.run(leaks).status == "ok"
    before = processes()
    assert worker.run(leaks).status == "ok"
    assert processes() == before
    monkeypatch.setattr(supervised, "LEAK", 1.0)
    assert worker.run(leaks).status == "ok"
    assert not processes()
    assert worker.run(SHORT).status == "ok"


def test_to_drain_ends_with_the_episodes_under_way(tmp_path: Path) -> None:
    (first, marker), (second, other) = once(tmp_path, "first"), once(tmp_path, "second")
    pool = LocalPool(2, time_limit=60.0)
    running = pool.run([first, SHORT, second, *[SHORT] * 9])
    assert next(running)[0] is SHORT
    victims = pid_in(marker), pid_in(other)
    pool.drain()
    for pid in victims:
        os.kill(pid, signal.SIGKILL)
    assert sorted(one.controller for one, _ in running) == sorted(
        [first.controller, second.controller]
    )
    assert not processes()


def test_an_error_of_the_pool_itself_is_raised_and_not_taken_for_an_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(self: Worker, episode: Episode) -> None:
        raise IndexError("a mistake")

    monkeypatch.setattr(Worker, "run", broken)
    with pytest.raises(IndexError, match="a mistake"):
        list(LocalPool(2).run([SHORT, SHORT]))


def test_nothing_to_run_is_no_error() -> None:
    assert list(LocalPool(2).run([])) == []

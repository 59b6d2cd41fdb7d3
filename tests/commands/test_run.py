"""``rightofway run`` unattended: killed, interrupted, out of disk, twice at once; all goes on."""

import json
import os
import re
import resource
import shlex
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil
import pytest
from factories.command_line import rightofway
from factories.processes import PATIENCE, heard, wait_for
from factories.workers import without_workers
from plugins import install

from benchmark.control import plugins
from benchmark.records.record import Record
from benchmark.records.store import Store

COMMAND = str(Path(sys.executable).parent / "rightofway")
STUDY = ("smoke/crossing", "smoke/tee", "--controller", "virtual-signal")
STUDY += ("--controller", "traffic-light", "--rate", "0.4")
THREE = (*STUDY, "--seeds", "3")
EPISODES = 12  # of three seeds
BOARDS = ("LEADERBOARD.md", "leaderboard.csv")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for PYTHONPATH with the hostile controllers."""
    return install(tmp_path_factory.mktemp("site") / "hostile")


@pytest.fixture
def hostile(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The hostile controllers are installed, in this process too."""
    monkeypatch.syspath_prepend(site)
    plugins.discovered.cache_clear()


def run(out: Path, *arguments: str) -> tuple[int, str]:
    """Run the command to its end, without workers; its exit code and what it said."""
    with without_workers():
        return run_with_workers(out, *arguments)


def run_with_workers(out: Path, *arguments: str) -> tuple[int, str]:
    done = rightofway(Path(), "run", *arguments, "--out", out)
    return done.returncode, done.stderr


@contextmanager
def started(
    out: Path, site: Path, *arguments: str, before: str = ""
) -> Iterator[subprocess.Popen[str]]:
    """The command under way, in a process group of its own; ended with all that it started."""
    path = os.pathsep.join(filter(None, (str(site), os.environ.get("PYTHONPATH"))))
    process = subprocess.Popen(
        ["sh", "-c", f'{before}\nexec "$0" "$@"', COMMAND, "run", *arguments, "--out", str(out)],
        env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=PATIENCE)


def lines(out: Path) -> list[bytes]:
    """The lines of all records, a torn one with them."""
    found = sorted((out / "records").glob("*.jsonl"))
    return [line for path in found for line in path.read_bytes().splitlines()]


def records(out: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in lines(out)]


def figures(out: Path) -> list[str]:
    """All records but for their wall times, sorted."""
    return sorted(json.dumps(one | {"wall_time": 0}) for one in records(out))


def until(ready: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Wait for something that the command is to do."""

    def is_ready() -> bool:
        assert process.poll() is None, process.communicate(timeout=PATIENCE)
        return ready()

    wait_for(is_ready)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study without any disturbance."""
    out = tmp_path_factory.mktemp("undisturbed")
    code, said = run(out, *THREE)
    assert code == 0, said
    assert len(records(out)) == EPISODES
    return out


def assert_as(out: Path, undisturbed: Path) -> None:
    """Every record is there once, and the leaderboard is the same."""
    assert figures(out) == figures(undisturbed)
    for name in BOARDS:
        assert (out / name).read_bytes() == (undisturbed / name).read_bytes()


def test_what_is_held_is_not_run_again_but_with_force(undisturbed: Path, tmp_path: Path) -> None:
    one_seed = (*STUDY, "--seed", "3")
    assert run(tmp_path, *one_seed)[0] == 0
    before = lines(tmp_path)
    assert len(before) == 4
    code, said = run(tmp_path, *THREE)
    assert (code, "4 of 12 episodes are in" in said) == (0, True)
    assert lines(tmp_path)[0] in before
    assert_as(tmp_path, undisturbed)
    held = lines(tmp_path)
    code, said = run(tmp_path, *THREE)
    assert (code, f"12 of 12 episodes are in {tmp_path}/records already; --force runs" in said) == (
        0,
        True,
    )
    assert lines(tmp_path) == held
    code, said = run(tmp_path, *one_seed, "--force")
    assert (code, "already" in said) == (0, False)
    assert Counter(one["seed"] for one in records(tmp_path))[3] == 8
    assert (tmp_path / BOARDS[0]).read_bytes() == (undisturbed / BOARDS[0]).read_bytes()


def test_worker_processes_make_the_same_records(undisturbed: Path, tmp_path: Path) -> None:
    code, said = run_with_workers(tmp_path, *THREE, "--workers", "2")
    assert code == 0, said
    assert_as(tmp_path, undisturbed)


@pytest.mark.usefixtures("hostile")
def test_the_command_killed_in_mid_episode_leaves_nothing_running_and_goes_on(
    site: Path, tmp_path: Path
) -> None:
    out, marker = tmp_path / "out", tmp_path / "marker"
    study = (*THREE, "--controller", f"hangs-once?marker={marker}")
    with started(out, site, *study, "--workers", "2") as process:
        until(lambda: marker.exists() and len(lines(out)) >= EPISODES, process)
        children = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGKILL)  # the parent alone
        process.wait(PATIENCE)
        assert not psutil.wait_procs(children, timeout=PATIENCE)[1]
    held = len(lines(out))
    assert EPISODES <= held < EPISODES + 6
    code, said = run(out, *study)
    assert (code, f"{held} of 18 episodes are in" in said) == (0, True)
    assert run(tmp_path / "whole", *study)[0] == 0
    assert_as(out, tmp_path / "whole")


@pytest.mark.slow
def test_the_command_killed_again_and_again_ends_with_each_record_once(
    site: Path, tmp_path: Path
) -> None:
    orphans, study, out = [], (*STUDY, "--seeds", "20"), tmp_path / "out"
    assert run(tmp_path / "whole", *study)[0] == 0
    for wanted in (1, 15, 40):
        with started(out, site, *study, "--workers", "2") as process:
            until(lambda wanted=wanted: len(lines(out)) >= wanted, process)  # type: ignore[misc]
            orphans += psutil.Process(process.pid).children(recursive=True)
            process.send_signal(signal.SIGKILL)
            process.wait(PATIENCE)
            assert not psutil.wait_procs(orphans, timeout=PATIENCE)[1]
    held = len(lines(out))
    assert 40 <= held < 80
    code, said = run(out, *study)
    assert code == 0, said
    assert re.search(rf"({held}|{held - 1}) of 80 episodes are in", said)  # the last may be torn
    assert_as(out, tmp_path / "whole")


def test_a_torn_last_line_is_run_again(undisturbed: Path, tmp_path: Path) -> None:
    (tmp_path / "records").mkdir()
    for path in (undisturbed / "records").iterdir():
        (tmp_path / "records" / path.name).write_bytes(path.read_bytes())
    path = tmp_path / "records" / "smoke-tee.jsonl"
    path.write_bytes(path.read_bytes()[:-700])
    code, said = run(tmp_path, *THREE)
    assert (code, "half-written last line was set aside" in said) == (0, True)
    assert "11 of 12 episodes are in" in said
    assert_as(tmp_path, undisturbed)


def test_a_second_command_on_the_folder_is_refused_and_does_no_harm(
    undisturbed: Path, tmp_path: Path
) -> None:
    assert run(tmp_path, *STUDY, "--seed", "1")[0] == 0
    before = lines(tmp_path)
    with Store(tmp_path).writing():
        code, said = run(tmp_path, *THREE)
    assert code == 2
    assert said == (
        f"error: {tmp_path}: another command is writing records here; let it finish, or "
        "choose another folder with --out\n"
    )
    assert lines(tmp_path) == before
    assert run(tmp_path, *THREE)[0] == 0
    assert_as(tmp_path, undisturbed)


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """The system refuses files beyond a size [bytes], as it does on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux refuses what is beyond the limit")
def test_a_full_disk_stops_with_a_message_and_the_command_goes_on_later(
    undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    append, room = Store.append, max(map(len, lines(undisturbed))) * 5 // 2

    def into_little_room(store: Store, record: Record) -> None:
        with room_for(room):
            append(store, record)

    with monkeypatch.context() as patch:
        patch.setattr(Store, "append", into_little_room)
        code, said = run(tmp_path, *THREE)
    assert code == 2
    assert said.count("error:") == 1
    assert "cannot append a record: File too large" in said
    assert "those before are whole: make room, and the same command goes on from there" in said
    assert "Traceback" not in said
    held = records(tmp_path)
    assert 2 <= len(held) < EPISODES
    assert {one["status"] for one in held} == {"ok"}
    code, said = run(tmp_path, *THREE)
    assert (code, f"{len(held)} of 12 episodes are in" in said) == (0, True)
    assert_as(tmp_path, undisturbed)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits address space")
def test_a_controller_that_takes_all_memory_costs_only_its_episodes(
    site: Path, tmp_path: Path
) -> None:
    names = ("--controller", "devours", "--controller", "virtual-signal")
    study = ("smoke/crossing", *names, "--rate", "0.5", "--seeds", "1", "--workers", "1")
    limit = "ulimit -v 1500000"  # kilobytes
    with started(tmp_path, site, *study, before=limit) as process:
        _, said = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1, said
    found = {(one["controller"], one["status"]): one["reason"] for one in records(tmp_path)}
    assert found.keys() == {("devours", "failed"), ("virtual-signal", "ok")}
    assert "MemoryError" in found["devours", "failed"]


@pytest.mark.usefixtures("hostile")
def test_ctrl_c_lets_running_episodes_finish_and_says_how_to_go_on(
    site: Path, tmp_path: Path
) -> None:
    marker = tmp_path / "marker"
    names = ("--controller", f"hangs-once?marker={marker}", "--controller", "virtual-signal")
    study = ("smoke/tee", *names, "--rate", "0.5", "--seeds", "6")
    out = tmp_path / "out"
    with started(out, site, *study, "--workers", "1") as process:
        until(lambda: marker.exists() and bool(marker.read_text()), process)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to the workers too
        said = heard(process, "finishing the running episodes; Ctrl-C again stops at once")
        os.kill(int(marker.read_text()), signal.SIGKILL)  # its second try does not hang
        said += process.communicate(timeout=PATIENCE)[1]
        assert process.returncode == 130
    done = records(out)
    assert 1 <= len(done) < 12
    assert done[-1]["controller"] == f"hangs-once?marker={marker}"
    assert {one["status"] for one in done} == {"ok"}
    assert f"stopped; {len(done)} of 12 records are in {out}/records; the same command" in said
    assert "Traceback" not in said
    code, said = run(out, *study)
    assert (code, f"{len(done)} of 12 episodes are in" in said) == (0, True)
    assert len(lines(out)) == 12


def test_a_second_ctrl_c_stops_at_once(site: Path, tmp_path: Path) -> None:
    names = ("--controller", "virtual-signal", "--controller", "hangs", "--seeds", "1")
    with started(tmp_path, site, "smoke/tee", *names, "--workers", "2") as process:
        until(lambda: len(lines(tmp_path)) == 1, process)
        os.killpg(process.pid, signal.SIGINT)
        said = heard(process, "finishing the running episodes")
        os.killpg(process.pid, signal.SIGINT)
        said += process.communicate(timeout=PATIENCE)[1]
        assert process.returncode == 130
    assert f"stopped; 1 of 2 records are in {tmp_path}/records; the same command goes on" in said
    assert "Traceback" not in said
    assert [one["status"] for one in records(tmp_path)] == ["ok"]


@pytest.mark.usefixtures("hostile")
def test_every_failure_is_named_with_the_command_that_shows_it_alone(tmp_path: Path) -> None:
    out, mine = tmp_path / "my results", tmp_path / "my files" / "mine.py"
    mine.parent.mkdir()
    mine.write_text(
        "from benchmark.control.controller import Controller\n"
        "class Mine(Controller):\n"
        "    def __init__(self, word: str = ''): self.word = word\n"
        "    def reset(self, intersection, seed): raise ValueError(self.word)\n"
        "    def act(self, state): return {}\n"
    )
    names = ("--controller", f"{mine}:Mine?word=it's", "--controller", "raises-in-act")
    more = ("--step-limit", "20", "--time-limit", "300")
    study = ("smoke/tee", *names, "--rate", "0.25", "--rate", "0.5", "--seeds", "1", *more)
    code, said = run(out, *study)
    assert code == 1
    found = [line.strip() for line in said.splitlines() if line.startswith("    rightofway")]
    assert len(found) == len(set(found)) == 4
    before = records(out)
    shown = {(one["controller"], one["rate"], one["seed"]): one for one in before}
    for line in found[:1] + found[-1:]:
        words = shlex.split(line)
        assert words[:2] == ["rightofway", "run"]
        at = words.index("--out")
        assert words[at + 1] == str(out)
        alone = tmp_path / "alone"
        code, _ = run(alone, *words[2:at])
        assert code == 1
        (one,) = records(alone)
        assert one == shown[one["controller"], one["rate"], one["seed"]] | {
            "wall_time": one["wall_time"]
        }
        (alone / "records" / "smoke-tee.jsonl").unlink()
    code, _ = run(out, *shlex.split(found[0])[2:-2])
    assert len(records(out)) == len(before) + 1


@pytest.mark.usefixtures("hostile")
def test_what_crashed_is_run_again_what_failed_is_named_again_and_the_log_has_it_all(
    tmp_path: Path,
) -> None:
    log = tmp_path / "logs" / "run.jsonl"
    names = ("crashes", "raises-in-reset", "virtual-signal")
    chosen = [part for name in names for part in ("--controller", name)]
    study = ("smoke/tee", *chosen, "--rate", "0.5", "--seed", "1", "--workers", "1")
    study += ("--log-file", str(log))
    code, said = run_with_workers(tmp_path / "out", *study)
    assert code == 1
    assert "raises-in-reset: 1 failed: reset raised KeyError" in said
    told = [json.loads(line) for line in log.read_text().splitlines()]
    assert Counter(one["event"] for one in told) == {
        "started": 1,
        "ended": 3,
        "tried again": 1,
        "stopped": 1,
    }
    assert (told[0]["event"], told[0]["episodes"], told[0]["held"]) == ("started", 3, 0)
    assert told[-1].items() >= {"records": 3, "failed": 2, "interrupted": False}.items()
    ended = {one["controller"]: one for one in told if one["event"] == "ended"}
    for one in records(tmp_path / "out"):
        for key in ("scenario", "rate", "seed", "status", "reason", "identity", "wall_time"):
            assert ended[one["controller"]][key] == one[key]
    assert all(one["time"].endswith("+00:00") for one in told)

    code, said = run_with_workers(tmp_path / "out", *study)
    assert code == 1
    assert "raises-in-reset: 1 failed: reset raised KeyError" in said
    found = Counter((one["controller"], one["status"]) for one in records(tmp_path / "out"))
    assert found == {
        ("crashes", "crashed"): 2,
        ("raises-in-reset", "failed"): 1,
        ("virtual-signal", "ok"): 1,
    }
    again = [json.loads(line) for line in log.read_text().splitlines()]
    assert again[: len(told)] == told
    assert again[len(told)].items() >= {"event": "started", "episodes": 1, "held": 2}.items()


def test_a_log_that_cannot_be_written_is_refused_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    code, said = run(tmp_path / "out", *THREE, "--log-file", str(tmp_path / "file" / "log"))
    assert code == 2
    assert "choose another file with --log-file" in said
    assert not (tmp_path / "out").exists()

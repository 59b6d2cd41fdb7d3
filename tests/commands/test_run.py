"""``rightofway run`` unattended: killed, interrupted, out of disk, twice at once; all goes on."""

import json
import os
import re
import resource
import shlex
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil
import pytest
from factories.processes import PATIENCE, heard
from plugins import install

COMMAND = str(Path(sys.executable).parent / "rightofway")
STUDY = ("smoke/crossing", "smoke/tee", "--controller", "virtual-signal")
STUDY += ("--controller", "traffic-light", "--rate", "0.4", "--seeds", "8", "--workers", "2")
EPISODES = 32
BOARDS = ("LEADERBOARD.md", "leaderboard.csv")


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for PYTHONPATH with the hostile controllers."""
    return install(tmp_path_factory.mktemp("site") / "hostile")


@contextmanager
def started(
    out: Path, *arguments: str, before: str = "", path: Path = Path()
) -> Iterator[subprocess.Popen[str]]:
    """The command under way, in a process group of its own; ended with all that it started."""
    known = os.environ.get("PYTHONPATH", "")
    process = subprocess.Popen(
        ["sh", "-c", f'{before}\nexec "$0" "$@"', COMMAND, "run", *arguments, "--out", str(out)],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, (str(path), known)))},
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
        process.communicate()


def run(out: Path, *arguments: str, before: str = "", path: Path = Path()) -> tuple[int, str]:
    """Run the command to its end; its exit code and what it said."""
    with started(out, *arguments, before=before, path=path) as process:
        _, said = process.communicate(timeout=PATIENCE)
        return process.returncode, said


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
    deadline = time.monotonic() + PATIENCE
    while not ready():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.005)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study without any disturbance."""
    out = tmp_path_factory.mktemp("undisturbed")
    code, said = run(out, *STUDY)
    assert code == 0, said
    assert len(records(out)) == EPISODES
    return out


def assert_as(out: Path, undisturbed: Path) -> None:
    """Every record is there once, and the leaderboard is the same."""
    assert figures(out) == figures(undisturbed)
    for name in BOARDS:
        assert (out / name).read_bytes() == (undisturbed / name).read_bytes()


def test_what_is_held_is_not_run_again_but_with_force(undisturbed: Path, tmp_path: Path) -> None:
    first = (*STUDY, "--seed", "3")
    seeds = tuple(one for one in first if one not in ("--seeds", "8"))
    assert run(tmp_path, *seeds)[0] == 0
    before = lines(tmp_path)
    assert len(before) == 4
    code, said = run(tmp_path, *STUDY)
    assert (code, "4 of 32 episodes are in" in said) == (0, True)
    assert lines(tmp_path)[0] in before
    assert_as(tmp_path, undisturbed)
    held = lines(tmp_path)
    code, said = run(tmp_path, *STUDY)
    assert (code, f"32 of 32 episodes are in {tmp_path}/records already; --force runs" in said) == (
        0,
        True,
    )
    assert lines(tmp_path) == held
    code, said = run(tmp_path, *seeds, "--force")
    assert (code, "already" in said) == (0, False)
    assert Counter(one["seed"] for one in records(tmp_path))[3] == 8
    assert (tmp_path / BOARDS[0]).read_bytes() == (undisturbed / BOARDS[0]).read_bytes()


def test_the_command_killed_again_and_again_ends_with_each_record_once(
    undisturbed: Path, tmp_path: Path
) -> None:
    orphans = []
    for wanted in (1, 9, 20):
        with started(tmp_path, *STUDY) as process:
            until(lambda wanted=wanted: len(lines(tmp_path)) >= wanted, process)  # type: ignore[misc]
            orphans += psutil.Process(process.pid).children(recursive=True)
            process.send_signal(signal.SIGKILL)  # the parent alone
            process.wait()
            assert not psutil.wait_procs(orphans, timeout=PATIENCE)[1]
    held = len(lines(tmp_path))
    assert 20 <= held < EPISODES
    code, said = run(tmp_path, *STUDY)
    assert code == 0, said
    assert re.search(rf"{held}|{held - 1} of 32 episodes are in", said)  # the last may be torn
    assert_as(tmp_path, undisturbed)


def test_a_torn_last_line_is_run_again(undisturbed: Path, tmp_path: Path) -> None:
    assert run(tmp_path, *STUDY)[0] == 0
    path = tmp_path / "records" / "smoke-tee.jsonl"
    path.write_bytes(path.read_bytes()[:-700])
    code, said = run(tmp_path, *STUDY)
    assert (code, "half-written last line was set aside" in said) == (0, True)
    assert "31 of 32 episodes are in" in said
    assert_as(tmp_path, undisturbed)


def test_what_crashed_is_run_again_and_what_failed_is_named_again(
    tmp_path: Path, hostile: Path
) -> None:
    names = ("--controller", "crashes", "--controller", "raises-in-reset")
    study = ("smoke/crossing", *names, "--rate", "0.5", "--seed", "1")
    for times in (1, 2):
        code, said = run(tmp_path, *study, path=hostile)
        assert code == 1
        found = Counter((one["controller"], one["status"]) for one in records(tmp_path))
        assert found == {("crashes", "crashed"): times, ("raises-in-reset", "failed"): 1}
        assert "raises-in-reset: 1 failed: reset raised KeyError" in said


def test_a_second_command_on_the_folder_is_refused_and_does_no_harm(
    tmp_path: Path, hostile: Path
) -> None:
    slow = ("smoke/tee", "--controller", "virtual-signal", "--controller", "hangs", "--seeds", "1")
    with started(tmp_path, *slow, path=hostile) as process:
        until(lambda: len(lines(tmp_path)) == 1, process)
        before = lines(tmp_path)
        code, said = run(tmp_path, *STUDY)
        assert code == 2
        assert said == (
            f"error: {tmp_path}: another command is writing records here; let it finish, or "
            "choose another folder with --out\n"
        )
        assert lines(tmp_path) == before
        assert process.poll() is None
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    assert run(tmp_path, "smoke/tee", "--controller", "virtual-signal", "--seeds", "1")[0] == 0


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits a process under way")
def test_a_full_disk_stops_with_a_message_and_the_command_goes_on_later(
    undisturbed: Path, tmp_path: Path
) -> None:
    """The system refuses the command files beyond a size, as it does on a disk that is full."""
    room = max(len(one) for one in lines(undisturbed)) * 5
    with started(tmp_path, *STUDY) as process:
        until(lambda: bool(lines(tmp_path)), process)
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (room, room))
        _, said = process.communicate(timeout=PATIENCE)
        assert process.returncode == 2
    assert said.count("error:") == 1
    assert "cannot append a record: File too large" in said
    assert "those before are whole: make room, and the same command goes on from there" in said
    assert "Traceback" not in said
    held = records(tmp_path)
    assert 5 <= len(held) < EPISODES
    assert {one["status"] for one in held} == {"ok"}
    code, said = run(tmp_path, *STUDY)
    assert (code, f"{len(held)} of 32 episodes are in" in said) == (0, True)
    assert_as(tmp_path, undisturbed)


def test_a_controller_that_takes_all_memory_costs_only_its_episodes(
    tmp_path: Path, hostile: Path
) -> None:
    names = ("--controller", "devours", "--controller", "virtual-signal")
    study = ("smoke/crossing", *names, "--rate", "0.5", "--seeds", "3", "--workers", "1")
    code, _ = run(tmp_path, *study, before="ulimit -v 1500000", path=hostile)  # kilobytes
    assert code == 1
    found = {(one["controller"], one["status"]): one["reason"] for one in records(tmp_path)}
    assert found.keys() == {("devours", "failed"), ("virtual-signal", "ok")}
    assert "MemoryError" in found["devours", "failed"]


def test_ctrl_c_lets_running_episodes_finish_and_says_how_to_go_on(
    tmp_path: Path, hostile: Path
) -> None:
    marker = tmp_path / "marker"
    names = ("--controller", f"hangs-once?marker={marker}", "--controller", "virtual-signal")
    study = ("smoke/tee", *names, "--rate", "0.5", "--seeds", "6", "--workers", "1")
    out = tmp_path / "out"
    with started(out, *study, path=hostile) as process:
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
    code, said = run(out, *study, path=hostile)
    assert (code, f"{len(done)} of 12 episodes are in" in said) == (0, True)
    assert len(lines(out)) == 12


def test_a_second_ctrl_c_stops_at_once(tmp_path: Path, hostile: Path) -> None:
    names = ("--controller", "virtual-signal", "--controller", "hangs", "--seeds", "1")
    with started(tmp_path, "smoke/tee", *names, path=hostile) as process:
        until(lambda: len(lines(tmp_path)) == 1, process)
        os.killpg(process.pid, signal.SIGINT)
        said = heard(process, "finishing the running episodes")
        os.killpg(process.pid, signal.SIGINT)
        said += process.communicate(timeout=PATIENCE)[1]
        assert process.returncode == 130
    assert f"stopped; 1 of 2 records are in {tmp_path}/records; the same command goes on" in said
    assert "Traceback" not in said
    assert [one["status"] for one in records(tmp_path)] == ["ok"]


def test_every_failure_is_named_with_the_command_that_shows_it_alone(
    tmp_path: Path, hostile: Path
) -> None:
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
    more = ("--step-limit", "2", "--time-limit", "30")
    study = ("smoke/tee", *names, "--rate", "0.25", "--rate", "0.5", "--seeds", "2", *more)
    code, said = run(out, *study, path=hostile)
    assert code == 1
    found = [line.strip() for line in said.splitlines() if line.startswith("    rightofway")]
    assert len(found) == len(set(found)) == 8
    before = records(out)
    shown = {(one["controller"], one["rate"], one["seed"]): one for one in before}
    for line in found[:1] + found[-1:]:
        words = shlex.split(line)
        assert words[:2] == ["rightofway", "run"]
        at = words.index("--out")
        assert words[at + 1] == str(out)
        alone = tmp_path / "alone"
        code, _ = run(alone, *words[2:at], path=hostile)
        assert code == 1
        (one,) = records(alone)
        assert one == shown[one["controller"], one["rate"], one["seed"]] | {
            "wall_time": one["wall_time"]
        }
        (alone / "records" / "smoke-tee.jsonl").unlink()
    code, _ = run(out, *shlex.split(found[0])[2:-2], path=hostile)
    assert len(records(out)) == len(before) + 1


def test_the_log_has_a_line_of_json_for_everything_that_happens(
    tmp_path: Path, hostile: Path
) -> None:
    log = tmp_path / "logs" / "run.jsonl"
    names = ("--controller", "crashes", "--controller", "virtual-signal", "--rate", "0.5")
    study = ("smoke/tee", *names, "--seed", "1", "--seed", "2", "--log-file", str(log))
    assert run(tmp_path / "out", *study, path=hostile)[0] == 1
    said = [json.loads(line) for line in log.read_text().splitlines()]
    assert Counter(one["event"] for one in said) == {
        "started": 1,
        "ended": 4,
        "tried again": 2,
        "stopped": 1,
    }
    assert (said[0]["event"], said[0]["episodes"], said[0]["held"]) == ("started", 4, 0)
    assert said[-1].items() >= {"records": 4, "failed": 2, "interrupted": False}.items()
    ended = {(one["controller"], one["seed"]): one for one in said if one["event"] == "ended"}
    for one in records(tmp_path / "out"):
        told = ended[one["controller"], one["seed"]]
        for key in ("scenario", "rate", "status", "reason", "identity", "wall_time"):
            assert told[key] == one[key]
    assert all(one["time"].endswith("+00:00") for one in said)
    assert run(tmp_path / "out", *study, path=hostile)[0] == 1
    again = [json.loads(line) for line in log.read_text().splitlines()]
    assert again[: len(said)] == said
    assert again[len(said)].items() >= {"event": "started", "episodes": 2, "held": 2}.items()


def test_a_log_that_cannot_be_written_is_refused_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    code, said = run(tmp_path / "out", *STUDY, "--log-file", str(tmp_path / "file" / "log"))
    assert code == 2
    assert "choose another file with --log-file" in said
    assert not (tmp_path / "out").exists()

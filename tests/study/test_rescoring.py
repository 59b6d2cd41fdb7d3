"""Episodes come out of their logs as they were, bit for bit, and without their controllers."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import polars
import pytest
from factories.logs import head_of, sealed
from factories.scenarios import shipped, smoke

from benchmark.control import plugins
from benchmark.records.record import Record
from benchmark.study import action_log, rescoring
from benchmark.study.actions import Action
from benchmark.study.episode import Episode
from benchmark.study.episodes import run_all

COMMAND = Path(sys.executable).parent / "rightofway"
KINDS = {  # controllers of every sort of command
    "virtual-signal?clearance=5": 0.6,  # Go and Stop
    "time-windows": 0.6,  # Drive, with accelerations
    "wang": 0.6,  # learned
    "max-pressure": None,  # Phase
    "traffic-light-actuated": None,  # a program of its own, no commands
}


def logged(folder: Path, controller: str) -> tuple[Record, Path]:
    episode = Episode(smoke("asymmetric"), controller, KINDS[controller], 4)
    record = rescoring.run_logged(episode, folder)
    return record, folder / action_log.name_of(record.episode)


@pytest.mark.parametrize("controller", KINDS)
def test_a_record_comes_out_of_its_log_without_the_controller(
    tmp_path: Path, controller: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    record, path = logged(tmp_path, controller)
    monkeypatch.setattr(plugins, "find", None)  # nobody looks for it
    log = action_log.read(path)
    again = rescoring.score(rescoring.LoggedEpisode.of(log))
    assert record.status == "ok"
    assert log.record == record
    assert again.model_copy(update={"wall_time": record.wall_time}) == record
    assert rescoring.differences(record, again) == []
    assert rescoring.versions_differ(record, again) is None


def test_a_log_takes_as_little_room_as_the_docs_say(tmp_path: Path) -> None:
    for controller, most in (("virtual-signal", 25_000), ("time-windows", 60_000)):
        rescoring.run_logged(Episode(shipped("colorado-springs/334"), controller, 0.6, 1), tmp_path)
        (path,) = tmp_path.iterdir()
        assert path.stat().st_size < most  # docs/submissions.md
        path.unlink()


def test_another_command_makes_another_record(tmp_path: Path) -> None:
    record, path = logged(tmp_path, "virtual-signal?clearance=5")
    turned = {"go": "stop", "stop": "go"}
    actions = [Action(*row) for row in polars.read_parquet(path).iter_rows()]
    sealed(path, action_log.frame([a._replace(command=turned[a.command]) for a in actions]))
    again = rescoring.score(rescoring.LoggedEpisode.of(action_log.read(path)))
    found = rescoring.differences(record, again)
    assert any(one.startswith("junctions.intersection.average_waiting_time: ") for one in found)
    assert all(" there, " in one and one.endswith(" now") for one in found)


def test_versions_are_told_apart_from_figures() -> None:
    one = Episode(smoke("tee"), "c", 0.5, 1).record("ok")
    other = one.model_copy(update={"versions": one.versions.model_copy(update={"sumo": "1.27"})})
    assert rescoring.differences(one, other) == []
    assert rescoring.versions_differ(other, one) == f"sumo 1.27 there, {one.versions.sumo} now"


def test_an_episode_that_does_not_end_well_leaves_no_log(tmp_path: Path) -> None:
    skipped = replace(Episode(smoke("tee"), "traffic-light", None, 1))
    unlit = skipped.scenario.model_copy(update={"signal": None})
    record = rescoring.run_logged(replace(skipped, scenario=unlit), tmp_path)
    assert record.status == "skipped"
    assert list(tmp_path.iterdir()) == []


# --- the command ---------------------------------------------------------------------------------


@pytest.fixture
def command(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    def run(*words: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [COMMAND, *map(str, words)], cwd=tmp_path, capture_output=True, text=True
        )

    return run


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logged")
    names = ("--controller", "virtual-signal", "--controller", "traffic-light")
    chosen = ("run", "smoke/tee", *names, "--rate", "0.6", "--seeds", "2", "--log-actions")
    done = subprocess.run([COMMAND, *chosen], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "out"


def test_run_writes_a_log_per_episode_and_replay_scores_them_all(
    results: Path, command: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    logs = sorted((results / "actions").iterdir())
    assert len(logs) == 4
    done = command("replay", *logs)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert [line.partition(": ")[0] for line in lines] == [str(log) for log in logs]
    assert all(": the same, bit for bit: " in line for line in lines)
    assert "virtual-signal on smoke/tee, rate 0.6, seed 2: average waiting time" in done.stdout


def test_replay_of_changed_commands_says_what_comes_out_otherwise(
    results: Path, tmp_path: Path, command: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    log = sorted((results / "actions").glob("*virtual-signal*"))[0]
    forged = tmp_path / "forged.parquet"
    forged.write_bytes(log.read_bytes())
    sealed(forged, polars.read_parquet(log).head(0))
    done = command("replay", forged)
    assert (done.returncode, done.stdout) == (1, "")
    assert "forged.parquet: comes out otherwise: " in done.stderr
    assert "the versions are the same: the log's commands or record were changed" in done.stderr
    old = head_of(log)["record"]
    old["versions"]["sumo"] = "1.27.0"
    sealed(forged, polars.read_parquet(log), record=old)
    done = command("replay", forged)
    assert done.returncode == 0
    assert "sumo 1.27.0 there, 1.28.0 now" in done.stderr


def test_replay_of_what_is_no_log_is_one_message(
    results: Path, tmp_path: Path, command: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    good = next((results / "actions").iterdir())
    for words in ((good, "notes.txt"), ("absent.parquet",)):
        done = command("replay", *words)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith("error: ")
        assert len(done.stderr.splitlines()) == 1


def test_log_actions_into_a_folder_that_cannot_be_is_one_message(
    tmp_path: Path, command: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "actions").write_text("mine")
    done = command("run", "tee", "--controller", "traffic-light", "--log-actions")
    assert done.returncode == 2
    assert done.stderr.startswith("error: out/actions: cannot write action logs")
    assert (tmp_path / "out" / "actions").read_text() == "mine"


def test_workers_score_logs_side_by_side(results: Path) -> None:
    logs = [action_log.read(one) for one in (results / "actions").iterdir()]
    episodes = [rescoring.LoggedEpisode.of(log) for log in logs]
    again = {one.episode: one for one in run_all(episodes, 2, work=rescoring.score)}
    assert all(rescoring.differences(log.record, again[log.record.episode]) == [] for log in logs)

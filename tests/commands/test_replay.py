"""The command ``rightofway replay``: logs are scored anew, traffic is shown."""

import subprocess
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import polars
import pytest
from factories import workers
from factories.command_line import rightofway
from factories.logs import head_of, sealed
from typer.testing import CliRunner

from benchmark.commands.app import app
from benchmark.pictures.replay.page import page
from benchmark.plumbing.errors import RightOfWayError
from benchmark.records.store import Store
from benchmark.reports.site import replays
from benchmark.study import action_log, rescoring
from benchmark.study.pool import LocalPool


@pytest.fixture
def command(
    tmp_path: Path, without_workers: None
) -> Callable[..., subprocess.CompletedProcess[str]]:
    return partial(rightofway, tmp_path)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logged")
    names = ("--controller", "virtual-signal", "--controller", "traffic-light")
    chosen = ("run", "smoke/tee", *names, "--rate", "0.6", "--seeds", "2", "--log-actions")
    with workers.without_workers():
        done = rightofway(folder, *chosen)
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
    logs = [action_log.read_log(one) for one in (results / "actions").iterdir()]
    episodes = [rescoring.LoggedEpisode.of(log) for log in logs]
    running = LocalPool(2, work=rescoring.rescore).run(episodes)
    again = {record.episode: record for _, record in running}
    assert all(rescoring.differences(log.record, again[log.record.episode]) == [] for log in logs)


Call = Callable[..., Any]


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_workers: None) -> Call:
    monkeypatch.chdir(tmp_path)

    def invoke(*arguments: object) -> Any:
        return CliRunner().invoke(app, [*map(str, arguments)])

    return invoke


RUN = ("run", "smoke/crossing", "--controller", "virtual-signal", "--seeds", 2)


def test_a_run_writes_a_page_for_each_episode_and_makes_up_for_missing_ones(
    call: Call, tmp_path: Path
) -> None:
    assert call(*RUN).exit_code == 0
    done = call(*RUN, "--record-trajectories", "--log-actions")
    assert done.exit_code == 0, done.output
    pages = sorted((tmp_path / "out" / "replays").glob("*.html"))
    assert len(pages) == 2
    assert len(Store(tmp_path / "out").read()) == 4
    (first, _) = replays.replays_in(tmp_path / "out")
    assert (first.scenarios, first.controllers) == (("smoke/crossing",), ("virtual-signal",))
    pages[0].unlink()
    done = call(*RUN, "--record-trajectories")
    assert "1 of 2 episodes are in" in done.output
    assert sorted((tmp_path / "out" / "replays").glob("*.html")) == pages
    assert "2 of 2 episodes are in" in call(*RUN, "--record-trajectories").output


def test_a_full_disk_stops_the_run_and_says_so(call: Call, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "replays").write_text("")
    done = call(*RUN, "--record-trajectories")
    assert isinstance(done.exception, RightOfWayError)
    assert "cannot write replays" in str(done.exception)
    assert not Store(tmp_path / "out").table(empty=True).height


def test_the_command_writes_a_page_of_controllers_side_by_side(call: Call, tmp_path: Path) -> None:
    chosen = ("--controller", "virtual-signal", "--controller", "traffic-light", "--rate", 0.5)
    done = call("replay", "smoke/crossing", *chosen, "--seed", 1)
    assert done.output == "replay.html\n"
    text = (tmp_path / "replay.html").read_text()
    assert len(page.shows(text[: page.HEAD])) == 2
    assert call("replay", "smoke/crossing", *chosen, "--seed", 1, "-o", "b.html").exit_code == 0
    assert (tmp_path / "b.html").read_text() == text  # the same episodes, the same bytes


def test_a_log_is_shown_as_its_controller_drove(call: Call, tmp_path: Path) -> None:
    assert call(*RUN, "--log-actions").exit_code == 0
    log = sorted((tmp_path / "out" / "actions").glob("*.parquet"))[0]
    done = call("replay", log, "-o", "log.html")
    assert done.exit_code == 0, done.output
    assert "the same, bit for bit" in done.output
    assert done.output.endswith("log.html\n")
    call("replay", "smoke/crossing", "--controller", "virtual-signal", "-o", "run.html")
    one, other = ((tmp_path / name).read_text() for name in ("log.html", "run.html"))
    assert one.count("<canvas") == other.count("<canvas")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["smoke/crossing"], "smoke/crossing: a scenario; name who drives with --controller"),
        (["nothing.parquet"], "nothing.parquet: cannot read the action log"),
        (["a", "b", "--controller", "wang"], "one scenario at a time, not 2: a, b"),
        (["nowhere", "--controller", "wang"], "nowhere"),
        (["tee", "--controller", "wong"], 'did you mean "wang"?'),
        (["tee", "--rate", "0.5"], "--rate and --seed go with a scenario"),
        (
            ["tee", "--controller", "wang", "--from", "5"],
            "--from and --to choose what a film",
        ),
        (["tee", "--controller", "wang", "--gif", "a.mp4"], "a.mp4: --gif writes another kind"),
        (["tee", "--controller", "wang", "--gif", "a.png"], "a.png: films are .gif or .mp4"),
        (["tee", "--controller", "wang", "-o", "file/x.html"], "cannot write"),
        (["tee", "--controller", "wang", "--gif", "a.gif", "--from", "999"], "nothing to film"),
    ],
)
def test_bad_input_gets_one_message(
    call: Call, tmp_path: Path, arguments: list[str], words: str
) -> None:
    (tmp_path / "file").write_text("")
    done = call("replay", *arguments)
    assert isinstance(done.exception, RightOfWayError), done.output
    assert words in str(done.exception)


def test_a_controller_that_fails_is_named(call: Call, tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text(
        "from benchmark.control.controller import Controller\nclass Bad(Controller):\n"
        "    def reset(self, intersection, seed): pass\n"
        "    def act(self, state): raise ValueError('no idea')\n"
    )
    done = call("replay", "smoke/crossing", "--controller", "bad.py:Bad")
    assert done.exit_code == 1
    assert "nothing to show, failed" in done.output
    assert "no idea" in done.output
    assert not (tmp_path / "replay.html").exists()

"""Training by the real command: it repeats, resumes exactly, refuses nonsense, and learns."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from factories.processes import PATIENCE, heard
from factories.scenarios import smoke
from safetensors.numpy import load_file

from baselines.wang.policy import Greedy
from benchmark.learning.folder import Folder
from benchmark.learning.rollout import Rollout, play
from benchmark.learning.settings import Options
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.models import Table
from benchmark.records.statistics import estimates

COMMAND = str(Path(sys.executable).parent / "rightofway")
TINY = (
    *("--scenario", "smoke/crossing", "--rate", "0.7", "--steps", "8000"),
    *(
        part
        for change in (
            *("learner.hidden=[32]", "learner.atoms=1", "traffic.duration=120", "traffic.seeds=5"),
            *("validation.rounds=2", "validation.seeds=1", "validation.rates=[0.7]"),
        )
        for part in ("--set", change)
    ),
)


def started(out: Path, *arguments: str, name: str = "wang") -> subprocess.Popen[str]:
    return subprocess.Popen(
        [COMMAND, "train", name, "--out", str(out), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def train(out: Path, *arguments: str, name: str = "wang") -> tuple[int, str]:
    """Run the command; its exit code and what it said."""
    process = started(out, *arguments, name=name)
    _, said = process.communicate(timeout=PATIENCE)
    return process.returncode, said


def manifest(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "manifest.json").read_text())
    return found


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was never disturbed."""
    out = tmp_path_factory.mktemp("training") / "run"
    code, said = train(out, *TINY, "--workers", "1")
    assert code == 0, said
    return out


def test_a_run_leaves_weights_manifest_checkpoint_and_logs(finished: Path) -> None:
    held = manifest(finished)
    assert held["name"] == "wang"
    assert held["seed"] == 1
    assert held["finished"] is True
    assert held["settings"]["learner"]["hidden"] == [32]
    assert held["settings"]["traffic"]["scenarios"] == ["smoke/crossing"]
    assert held["wall_time"] > 0
    assert held["command"][:3] == ["rightofway", "train", "wang"]
    assert {"torch", "stable-baselines3", "rightofway"} <= held["versions"].keys()
    assert len(held["code"]) == 64
    assert len(held["validated"]) >= 2
    assert load_file(finished / "weights.safetensors")["trunk.0.weight"].shape == (32, 97)
    assert list((finished / "logs").glob("events.out.tfevents.*"))


def test_the_same_seed_gives_the_same_weights_however_many_workers(
    finished: Path, tmp_path: Path
) -> None:
    assert train(tmp_path / "two", *TINY, "--workers", "2")[0] == 0
    assert manifest(tmp_path / "two")["digest"] == manifest(finished)["digest"]
    assert train(tmp_path / "other", *TINY, "--seed", "2")[0] == 0
    assert manifest(tmp_path / "other")["digest"] != manifest(finished)["digest"]


def rounds(process: subprocess.Popen[str], out: Path) -> Iterator[int]:
    """The number of rounds that the log shows, again and again."""
    log = out / "logs" / "progress.csv"
    while process.poll() is None:
        yield max(0, len(log.read_text().splitlines()) - 1) if log.exists() else 0
        time.sleep(0.02)


def wait_for(process: subprocess.Popen[str], out: Path, wanted: int) -> None:
    assert any(count >= wanted for count in rounds(process, out)), process.communicate()


def test_a_run_that_was_interrupted_goes_on_exactly_where_it_stopped(
    finished: Path, tmp_path: Path
) -> None:
    process = started(tmp_path / "run", *TINY)
    wait_for(process, tmp_path / "run", 1)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "stopping after this round" in said
    assert "continue with --resume" in said
    assert manifest(tmp_path / "run")["decisions"] < 8000
    logs = tmp_path / "run" / "logs"
    before = (logs / "progress.csv").read_bytes()
    code, said = train(tmp_path / "run", *TINY, "--resume")
    assert code == 0, said
    assert (logs / "progress.csv").read_bytes() == before  # the rest stands beside it
    assert list(logs.glob("progress-from-*.csv"))
    assert manifest(tmp_path / "run")["digest"] == manifest(finished)["digest"]


def test_a_run_that_was_killed_goes_on_from_its_last_checkpoint(
    finished: Path, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    process = started(out, *TINY)
    wait_for(process, out, 3)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate(timeout=PATIENCE)
    assert (out / "checkpoint.pt").exists()
    assert train(out, *TINY, "--resume")[0] == 0
    assert manifest(out)["digest"] == manifest(finished)["digest"]


SLOW = (
    *("--scenario", "229", "--rate", "0.4", "--workers", "1"),
    *(
        part
        for change in (
            *("learner.hidden=[8]", "learner.atoms=1", "traffic.episodes=20"),
            *("traffic.duration=400", "traffic.gridlock_after=5000", "validation.rounds=100"),
        )
        for part in ("--set", change)
    ),
)
"""Rounds that take many seconds, so that two signals are sure to fall within one."""


def test_a_second_interrupt_stops_at_once(tmp_path: Path) -> None:
    process = started(tmp_path / "run", *SLOW)
    while not (tmp_path / "run" / "logs" / "progress.csv").exists():  # until signals are heard
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    said = heard(process, "stopping after this round")
    os.killpg(process.pid, signal.SIGINT)
    said += process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 130
    assert "continue with --resume" not in said  # as it says where the round was finished
    assert "Traceback" not in said
    assert not (tmp_path / "run" / "checkpoint.pt").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "holds a training run; continue it with --resume, or give another --out"),
        (("--resume",), "the training run there is finished"),
    ],
)
def test_a_finished_run_is_neither_overwritten_nor_continued(
    arguments: tuple[str, ...], message: str, finished: Path
) -> None:
    before = (finished / "weights.safetensors").read_bytes()
    code, said = train(finished, *TINY, *arguments)
    assert (code, message in " ".join(said.split())) == (2, True), said
    assert (finished / "weights.safetensors").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--set", "reward.penalty=0.5"), "another settings.*reward: penalty: 1.0 there, 0.5 now"),
        (("--seed", "7"), "another seed.*1 there, 7 now"),
    ],
)
def test_a_run_is_not_resumed_under_other_settings(
    arguments: tuple[str, ...], message: str, finished: Path, tmp_path: Path
) -> None:
    held = manifest(finished)
    del held["finished"]
    (tmp_path / "manifest.json").write_text(json.dumps(held))
    (tmp_path / "checkpoint.pt").write_bytes(b"never read")
    code, said = train(tmp_path, *TINY, "--resume", *arguments)
    assert code == 2
    assert re.search(message, " ".join(said.split())), said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--resume",), "no training run to resume; leave out --resume"),
        (("--set", "reward.penalty"), "expected table.key=value"),
        (("--set", "reward.penalty=high"), "expected table.key=value, as TOML"),
        (("--set", "reward.penalti=1"), 'unknown key "penalti"; did you mean "penalty"?'),
        (("--set", "layout.x=1"), '"layout" is not a table'),
        (("--set", "learner.batch=0"), "learner.batch"),
        (("--set", 'learner.batch="x"'), "learner.batch: expected a whole number; got"),
        (("--scenario", "smoke/teh"), 'did you mean "smoke/tee"?'),
        (("--rate", "1.5"), "Invalid value for '--rate'"),
        (("--set", "learner.hidden=[-4]"), "learner.hidden"),
        (("--set", "traffic.demand=[]"), "traffic.demand"),
        (("--set", "learner.value_range=[1.0, 1.0]"), "expected the lower bound first"),
        (("--set", "validation.rates=[2.0]"), "validation.rates"),
        (("--scenario", ""), "traffic.scenarios"),
        (("--steps", "0"), "Invalid value for '--steps'"),
    ],
)
def test_what_makes_no_sense_is_refused_with_one_message(
    arguments: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    code, said = train(tmp_path / "run", *arguments)
    assert code == 2
    assert message in " ".join(said.replace("│", " ").split()), said
    assert "Traceback" not in said
    assert not (tmp_path / "run").exists()


def test_a_rate_at_which_nobody_decides_ends_with_a_message(tmp_path: Path) -> None:
    nobody = ["0" if part == "0.7" else part for part in TINY]
    code, said = train(tmp_path / "run", *nobody)
    assert code == 2
    assert "nobody decided in a whole round" in said


def test_a_finished_run_stays_without_its_checkpoint_too(finished: Path, tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_bytes((finished / "manifest.json").read_bytes())
    for resume, words in ((False, "holds a training run"), (True, "is finished")):
        with pytest.raises(UsageError, match=words):
            Folder(Options(tmp_path, resume=resume), "wang", Table())


def test_a_run_that_ended_before_its_first_checkpoint_starts_anew(tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_text("{}")  # all that a start without its packages left
    Folder(Options(tmp_path), "wang", Table())
    assert manifest(tmp_path)["name"] == "wang"


@pytest.mark.parametrize(("file", "content"), [("manifest.json", "{"), ("checkpoint.pt", "PK")])
def test_a_damaged_run_is_not_resumed(
    file: str, content: str, finished: Path, tmp_path: Path
) -> None:
    held = manifest(finished)
    del held["finished"]
    (tmp_path / "manifest.json").write_text(json.dumps(held))
    (tmp_path / "checkpoint.pt").write_bytes((finished / "checkpoint.pt").read_bytes())
    (tmp_path / file).write_text(content)
    code, said = train(tmp_path, *TINY, "--resume")
    assert code == 2
    assert f"{file}: damaged; start anew with another --out" in " ".join(said.split())


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    code, said = train(tmp_path / "file" / "run")
    assert code == 2
    assert "cannot write there: Not a directory; give another --out" in " ".join(said.split())


def test_an_unknown_name_suggests_the_nearest(tmp_path: Path) -> None:
    code, said = train(tmp_path, name="wong")
    assert (code, said) == (2, 'error: nothing trains "wong"; did you mean "wang"?\n')


def test_what_is_learnt_waits_significantly_less_than_random_decisions(tmp_path: Path) -> None:
    settings = (
        *("learner.hidden=[64,64]", "learner.atoms=1", "learner.discount=0.9"),
        *("learner.learning_rate=1e-3", "learner.decisions_per_update=8", "learner.batch=64"),
        *("learner.target_every=100", "reward.longest_wait=20.0", "reward.penalty=0.2"),
        *("traffic.duration=120", "traffic.demand=[3.5]", "learner.exploring=0.5"),
        *("validation.rounds=100", "validation.seeds=1", "validation.rates=[1.0]"),
    )
    changes = [part for change in settings for part in ("--set", change)]
    code, said = train(
        tmp_path / "run",
        "--scenario",
        "smoke/crossing",
        "--rate",
        "0.7",
        "--steps",
        "6000",
        *changes,
    )
    assert code == 0, said
    policy = Greedy(load_file(tmp_path / "run" / "weights.safetensors"))
    scenario = smoke("crossing").with_demand(3.5)
    differences = []
    for seed in range(1001, 1013):
        learnt, random = (
            play(Rollout(scenario, 1.0, seed, exploration=share, gridlock_after=None), policy)
            for share in (0.0, 1.0)
        )
        assert learnt.average_waiting_time is not None
        assert random.average_waiting_time is not None
        differences.append(learnt.average_waiting_time - random.average_waiting_time)
    (found,) = estimates([differences])
    assert found.excludes_zero
    assert found.mean < 0
    assert np.mean(differences) < -1

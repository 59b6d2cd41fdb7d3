"""Training by the command: it repeats, resumes exactly, refuses nonsense, and learns."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from factories.command_line import rightofway
from factories.processes import PATIENCE, heard, wait_for
from factories.scenarios import smoke
from factories.training import without_workers
from safetensors.numpy import load_file

from baselines.wang.policy import Greedy
from baselines.wang.train import QLearning
from benchmark.learning import rounds
from benchmark.learning.folder import Folder
from benchmark.learning.rollout import Rollout, play
from benchmark.learning.settings import Options
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.models import Table
from benchmark.records.statistics import estimates

COMMAND = str(Path(sys.executable).parent / "rightofway")
STEPS = 1500
TINY = (
    *("--scenario", "smoke/crossing@960", "--rate", "0.7", "--steps", str(STEPS)),
    *(
        part
        for change in (
            *("learner.hidden=[16]", "learner.atoms=1", "traffic.duration=60", "traffic.seeds=5"),
            *("traffic.episodes=2", "validation.rounds=2", "validation.seeds=1"),
            "validation.rates=[0.7]",
        )
        for part in ("--set", change)
    ),
)


@contextmanager
def started(out: Path, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """The command under way, in a process group of its own; ended with all that it started."""
    process = subprocess.Popen(
        [COMMAND, "train", "wang", "--out", str(out), *arguments],
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


def train(out: Path, *arguments: str, name: str = "wang") -> tuple[int, str]:
    """Run the command, without processes that play; its exit code and what it said."""
    with without_workers(rounds):
        done = rightofway(Path(), "train", name, "--out", out, *arguments)
    return done.returncode, done.stderr


def manifest(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "manifest.json").read_text())
    return found


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was never disturbed."""
    out = tmp_path_factory.mktemp("training") / "run"
    code, said = train(out, *TINY)
    assert code == 0, said
    return out


def test_a_run_leaves_weights_manifest_checkpoint_and_logs(finished: Path) -> None:
    held = manifest(finished)
    assert held["name"] == "wang"
    assert held["seed"] == 1
    assert held["finished"] is True
    assert held["settings"]["learner"]["hidden"] == [16]
    assert held["settings"]["traffic"]["scenarios"] == ["smoke/crossing@960"]
    assert held["wall_time"] > 0
    assert held["command"][:3] == ["rightofway", "train", "wang"]
    assert {"torch", "stable-baselines3", "rightofway"} <= held["versions"].keys()
    assert len(held["code"]) == 64
    assert len(held["validated"]) >= 3
    assert load_file(finished / "weights.safetensors")["trunk.0.weight"].shape == (16, 97)
    assert list((finished / "logs").glob("events.out.tfevents.*"))


def test_the_same_seed_gives_the_same_weights_however_many_workers(
    finished: Path, tmp_path: Path
) -> None:
    two = rightofway(tmp_path, "train", "wang", "--out", "two", *TINY, "--workers", "2")
    assert two.returncode == 0, two.stderr
    assert manifest(tmp_path / "two")["digest"] == manifest(finished)["digest"]
    assert train(tmp_path / "other", *TINY, "--seed", "2")[0] == 0
    assert manifest(tmp_path / "other")["digest"] != manifest(finished)["digest"]


@pytest.fixture
def in_round(monkeypatch: pytest.MonkeyPatch) -> Callable[[int, Callable[[], object]], None]:
    """Lets something happen once, while a run learns from a round."""
    learn = QLearning._learn

    def arrange(number: int, happen: Callable[[], object]) -> None:
        left = [happen]

        def disturbed(self: QLearning, played: Any, before: int) -> Any:
            if self.course.round == number and left:
                left.pop()()
            return learn(self, played, before)

        monkeypatch.setattr(QLearning, "_learn", disturbed)

    return arrange


InRound = Callable[[int, Callable[[], object]], None]


def ctrl_c() -> None:
    signal.raise_signal(signal.SIGINT)


def test_a_run_that_was_interrupted_goes_on_exactly_where_it_stopped(
    finished: Path, tmp_path: Path, in_round: InRound
) -> None:
    in_round(3, ctrl_c)
    code, said = train(tmp_path / "run", *TINY)
    assert code == 130
    assert "stopping after this round" in said
    assert "continue with --resume" in said
    assert manifest(tmp_path / "run")["decisions"] < STEPS
    logs = tmp_path / "run" / "logs"
    before = (logs / "progress.csv").read_bytes()
    code, said = train(tmp_path / "run", *TINY, "--resume")
    assert code == 0, said
    assert (logs / "progress.csv").read_bytes() == before  # the rest stands beside it
    assert list(logs.glob("progress-from-*.csv"))
    assert manifest(tmp_path / "run")["digest"] == manifest(finished)["digest"]


class PowerCutError(BaseException):
    """Nothing in the program expects it, nor gets to do anything more."""


def power_cut() -> None:
    raise PowerCutError


def test_a_run_that_broke_off_goes_on_from_its_last_checkpoint(
    finished: Path, tmp_path: Path, in_round: InRound
) -> None:
    in_round(4, power_cut)
    with pytest.raises(PowerCutError):
        train(tmp_path / "run", *TINY)
    assert manifest(tmp_path / "run")["round"] == 2
    assert train(tmp_path / "run", *TINY, "--resume")[0] == 0
    assert manifest(tmp_path / "run")["digest"] == manifest(finished)["digest"]


def test_a_second_interrupt_stops_at_once(tmp_path: Path, in_round: InRound) -> None:
    def twice() -> None:
        ctrl_c()
        ctrl_c()

    in_round(1, twice)
    code, said = train(tmp_path / "run", *TINY)
    assert code == 130
    assert "stopping after this round; Ctrl-C again stops at once" in said
    assert "continue with --resume" not in said  # as it says where the round was finished
    assert not (tmp_path / "run" / "checkpoint.pt").exists()


def until(process: subprocess.Popen[str], out: Path, lines: int) -> None:
    """Wait until the log has so many lines, the first of which is its head."""

    def has_them() -> bool:
        assert process.poll() is None, process.communicate(timeout=PATIENCE)
        return log.exists() and len(log.read_text().splitlines()) >= lines

    log = out / "logs" / "progress.csv"
    wait_for(has_them)


LONG = (*TINY, "--steps", "20000")
"""Seconds in which a signal is sure to fall."""


@pytest.mark.slow
def test_a_real_process_that_is_interrupted_or_killed_goes_on_exactly(tmp_path: Path) -> None:
    assert train(tmp_path / "whole", *LONG)[0] == 0
    for number, code in ((signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)):
        out = tmp_path / number.name
        with started(out, *LONG) as process:
            until(process, out, 4)
            os.killpg(process.pid, number)
            process.communicate(timeout=PATIENCE)
            assert process.returncode == code
        assert (out / "checkpoint.pt").exists()
        assert manifest(out)["decisions"] < 20_000
        assert train(out, *LONG, "--resume")[0] == 0
        assert manifest(out)["digest"] == manifest(tmp_path / "whole")["digest"]


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


@pytest.mark.slow
def test_a_second_interrupt_stops_a_real_process_with_its_workers_at_once(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with started(out, *SLOW) as process:
        until(process, out, 0)  # until signals are heard
        os.killpg(process.pid, signal.SIGINT)
        said = heard(process, "stopping after this round")
        os.killpg(process.pid, signal.SIGINT)
        said += process.communicate(timeout=PATIENCE)[1]
        assert process.returncode == 130
    assert "continue with --resume" not in said
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


@pytest.mark.slow
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
        "smoke/crossing@960",
        "--rate",
        "0.7",
        "--steps",
        "12000",
        *changes,
    )
    assert code == 0, said
    policy = Greedy(load_file(tmp_path / "run" / "weights.safetensors"))
    scenario = smoke("crossing").at_demand(3360)
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
    assert found.mean < -1.0  # s; random decisions wait 3.6 s

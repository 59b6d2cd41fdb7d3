"""How far a training run has come: what is judged, logged and kept, whatever learns."""

import csv
from pathlib import Path

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import PPO

from benchmark.learning.course import Course
from benchmark.learning.folder import Folder
from benchmark.learning.rollout import Played
from benchmark.learning.rounds import SpacesOnly
from benchmark.learning.settings import Options, Validation
from benchmark.learning.weights import Arrays, load
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.models import Table

VALIDATION = Validation(rounds=2, gridlock=300.0)
STEPS = 1000


def ended(average_waiting_time: float | None, *, gridlocked: bool = False) -> Played:
    return Played((), average_waiting_time, 0, gridlocked)


def model(seed: int) -> PPO:
    return PPO(
        "MlpPolicy",
        SpacesOnly(3, spaces.Box(-1.0, 1.0, (2,))),
        n_steps=8,
        batch_size=8,
        seed=seed,
        device="cpu",
    )


def course(out: Path, seed: int = 1, *, resume: bool = False) -> Course:
    options = Options(out, seed=1, resume=resume, notify=lambda words: None)
    return Course(model(seed), Folder(options, "it", Table()), options, VALIDATION, STEPS)


def weights(value: float) -> Arrays:
    return {"a": np.full(2, value, np.float32)}


def logged(out: Path, name: str = "progress") -> list[dict[str, str]]:
    with (out / "logs" / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_jam_counts_as_much_as_the_settings_say_and_the_best_weights_are_kept(
    tmp_path: Path,
) -> None:
    one = course(tmp_path)
    with one.shown():
        one.judge([ended(10.0), ended(2.0, gridlocked=True)], weights(1.0))
        assert one.best is not None
        assert (one.best.waiting, one.best.gridlocked) == (155.0, 1)
        one.judge([ended(20.0), ended(None)], weights(2.0))
        one.judge([ended(30.0)], weights(3.0))
    assert (one.best.waiting, one.best.arrays["a"][0]) == (10.0, 2.0)


def test_what_a_round_and_its_validation_came_to_stands_in_one_line(tmp_path: Path) -> None:
    one = course(tmp_path)
    with one.shown() as show:
        for number in (1, 2):
            one.round, one.decisions = number, 100 * number
            one.log([ended(4.0 * number)], reward=-0.5)
            if one.validates:
                one.judge([ended(3.0)], weights(1.0))
            show()
    first, second = logged(tmp_path)
    assert (first["rollout/waiting"], first["validation/waiting"]) == ("4.0", "")
    assert (second["rollout/waiting"], second["validation/waiting"]) == ("8.0", "3.0")
    assert second["rollout/reward"] == "-0.5"


def test_a_run_goes_on_from_all_that_it_kept(tmp_path: Path) -> None:
    one = course(tmp_path)
    with one.shown():
        one.round, one.decisions = 4, 400
        one.judge([ended(1.0)], weights(1.0))
        one._model._n_updates = 7
        one.save(more=torch.ones(2))
    other = course(tmp_path, seed=2, resume=True)
    assert other.restore()["more"].tolist() == [1.0, 1.0]
    assert (other.round, other.decisions, other._model._n_updates) == (4, 400, 7)
    for mine, its in zip(
        one._model.policy.parameters(), other._model.policy.parameters(), strict=True
    ):
        assert torch.equal(mine, its)
    with other.shown():
        other.judge([ended(5.0)], weights(5.0))
        other.finish(hidden=(8,))
    kept = load(tmp_path / "weights.safetensors", {"a": (2,)}, "")
    assert kept.arrays["a"].tolist() == [1.0, 1.0]
    assert kept.notes["validation"] == {"waiting": 1.0, "gridlocked": 0}
    assert kept.notes["round"] == 4
    held = other._folder.manifest
    assert [entry["waiting"] for entry in held["validated"]] == [1.0, 5.0]
    assert held["finished"] is True
    assert (tmp_path / "logs" / "progress-from-4.csv").exists()


def test_it_is_done_with_as_many_decisions_as_were_asked_for(tmp_path: Path) -> None:
    one = course(tmp_path)
    assert not one.is_done
    assert not one.validates  # before the first round there is nothing to judge
    one.round, one.decisions = 2, STEPS
    assert one.is_done
    assert one.validates


@pytest.mark.parametrize(
    ("decisions", "said"),
    [
        (2506, "learnt from 2,506 decisions in 3 rounds; 1,000 were asked for, and a run ends"),
        (STEPS, "learnt from 1,000 decisions in 3 rounds"),
    ],
)
def test_progress_and_the_last_words_say_how_much_was_really_played(
    tmp_path: Path, decisions: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    one = course(tmp_path)
    heard: list[str] = []
    one._notify = heard.append
    with one.shown() as show:
        one.round, one.decisions = 3, decisions
        one.judge([ended(1.0)], weights(1.0))
        show()
    assert f"{decisions:,}/1,000 decisions" in capsys.readouterr().err
    one.finish()
    assert heard[-1].startswith(said)
    assert (heard[-1] == said) is (decisions == STEPS)


@pytest.mark.parametrize("content", [b"", b"PK", b"\x80\x02."])
def test_a_damaged_checkpoint_is_named(tmp_path: Path, content: bytes) -> None:
    one = course(tmp_path)
    one.save()
    (tmp_path / "checkpoint.pt").write_bytes(content)
    with pytest.raises(UsageError, match=r"checkpoint\.pt: damaged; start anew"):
        course(tmp_path, resume=True).restore()

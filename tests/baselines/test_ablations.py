"""Networks of other settings than the published ones: trained, loaded, evaluated."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from factories.command_line import rightofway
from factories.scenarios import smoke
from factories.training import without_workers

from baselines.hierarchical.controller import Hierarchical
from baselines.hierarchical.policy import shapes as low_level_shapes
from baselines.wang.controller import Wang, WangTuned
from baselines.wang.policy import shapes
from benchmark.learning import rounds
from benchmark.learning.weights import Shapes, save
from benchmark.plumbing.errors import ControllerError
from benchmark.study.episode import Episode, run_episode

TINY = (
    *("--scenario", "smoke/crossing", "--rate", "0.7", "--steps", "20"),
    *("--set", "traffic.duration=40", "--set", "traffic.episodes=1"),
    *("--set", "validation.seeds=1", "--set", "validation.rates=[0.7]"),
)


def trained(out: Path, name: str, *changes: str) -> tuple[Path, str]:
    """Weights of a run under changed settings, and what the command said."""
    parts = [part for change in changes for part in ("--set", change)]
    with without_workers(rounds):
        done = rightofway(Path(), "train", name, "--out", out, *TINY, *parts)
    assert done.returncode == 0, done.stderr
    return out / "weights.safetensors", done.stderr


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("wang", ("learner.atoms=1", "learner.hidden=[32]", 'layout="extended"')),
        ("wang-tuned", ("learner.atoms=7", "learner.hidden=[8, 16]", 'layout="paper"')),
        ("hierarchical", ("learner.hidden=[16]",)),
    ],
)
def test_an_ablation_that_was_trained_drives_an_episode(
    name: str, changes: tuple[str, ...], tmp_path: Path
) -> None:
    path, said = trained(tmp_path / "run", name, *changes)
    decisions = re.search(r"learnt from (\d+) decisions in 1 round; 20 were asked for", said)
    assert decisions, said
    assert int(decisions[1]) > 20
    record = run_episode(Episode(smoke("crossing"), f"{name}?weights={path}", 0.7, 1))
    assert record.status == "ok", record


def written(path: Path, wanted: Shapes, notes: dict[str, Any]) -> Path:
    random = np.random.default_rng(1)
    arrays = {name: random.normal(size=shape).astype(np.float32) for name, shape in wanted.items()}
    save(path, arrays, notes)
    return path


@pytest.mark.parametrize("kind", [Wang, WangTuned])
@pytest.mark.parametrize("layout", ["paper", "extended"])
def test_the_layout_is_what_the_weights_were_trained_with(
    kind: type[Wang], layout: Any, tmp_path: Path
) -> None:
    notes = {"layout": layout, "hidden": [4], "atoms": 1}
    wang = kind(written(tmp_path / "w.safetensors", shapes(layout, (4,), 1), notes))
    assert wang._layout == layout
    assert (kind()._layout, Wang()._layout) == (kind.LAYOUT, "paper")


@pytest.mark.parametrize(
    "notes",
    [
        {"hidden": []},
        {"hidden": [0]},
        {"hidden": "512"},
        {"atoms": 0},
        {"layout": "papre"},
        {"layout": None},
    ],
)
def test_notes_that_describe_no_network_are_refused(notes: dict[str, Any], tmp_path: Path) -> None:
    path = written(tmp_path / "w.safetensors", shapes("paper", (4,), 1), notes)
    with pytest.raises(ControllerError, match="the notes in the file are damaged"):
        Wang(path)


def test_notes_of_another_network_than_the_arrays_are_refused(tmp_path: Path) -> None:
    notes = {"hidden": [5], "atoms": 1}
    path = written(tmp_path / "w.safetensors", shapes("paper", (4,), 1), notes)
    with pytest.raises(ControllerError, match=r"advantage\.weight is \(2, 4\), expected \(2, 5\)"):
        Wang(path)


@pytest.mark.parametrize("hidden", [[], [0], "64", [64.5]])
def test_notes_that_describe_no_low_level_are_refused(hidden: object, tmp_path: Path) -> None:
    wanted = low_level_shapes(Hierarchical.SIZE, (4,))
    path = written(tmp_path / "w.safetensors", wanted, {"hidden": hidden})
    with pytest.raises(ControllerError, match="the notes in the file are damaged"):
        Hierarchical(weights=path)

"""What a training run depends on, and so refuses to resume without."""

from pathlib import Path

import pytest

import benchmark
from baselines.wang.train import WangSettings
from benchmark.control import code
from benchmark.learning import folder


def test_the_code_of_a_training_is_what_determines_episodes_with_the_room_of_learning() -> None:
    root = Path(benchmark.__file__).parent
    names = {name for name, _ in code.determining(root, ("learning",))}
    assert {"learning/course.py", "learning/rounds.py", "world/world.py"} <= names
    apart = ("reports/", "commands/", "pictures/", "admission/")
    assert not [name for name in names if name.startswith(apart)]


def test_the_trainers_own_module_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = WangSettings.model_construct()
    asked = []
    monkeypatch.setattr(code, "of_module", lambda module: asked.append(module) or module)
    before = folder._code_hash(settings)
    monkeypatch.setattr(code, "of_module", lambda module: "edited")
    assert asked == ["baselines.wang.train"]
    assert folder._code_hash(settings) != before

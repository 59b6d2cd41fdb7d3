"""Which code counts: of this package by room, of a plugin's by what its controller imports."""

import shutil
from collections.abc import Iterator
from importlib.metadata import entry_points
from pathlib import Path

import grimp
import pytest
from factories.scenarios import ROOT

from benchmark.control import code


@pytest.fixture(autouse=True)
def _asked_anew() -> Iterator[None]:
    yield
    for cached in (code.of_package, code.of_module, code.of_code_and_weights):
        cached.cache_clear()


def hash_of(module: str) -> str:
    code.of_module.cache_clear()
    code.of_package.cache_clear()
    return code.of_module(module)


def imported_by_episodes() -> set[str]:
    """Files of the package that an episode under a shipped controller imports, directly or not."""
    graph = grimp.build_graph("benchmark", "baselines", exclude_type_checking_imports=True)
    starts = ["benchmark.study.episode"]
    starts += [entry.module for entry in entry_points(group="rightofway.controllers")]
    modules = set(starts).union(
        *(graph.find_upstream_modules(start) for start in starts if start in graph.modules)
    )
    names = [name.split(".")[1:] for name in modules if name.startswith("benchmark.")]
    places = [ROOT / "benchmark" / Path(*parts) for parts in names]
    files = [
        place / "__init__.py" if place.is_dir() else place.with_suffix(".py") for place in places
    ]
    return {path.relative_to(ROOT / "benchmark").as_posix() for path in files}


def test_every_file_that_an_episode_imports_determines_it() -> None:
    counted = {name for name, _ in code.determining(ROOT / "benchmark")}
    packages = {"records/__init__.py", "study/__init__.py"}  # a docstring each
    assert imported_by_episodes() - counted <= packages
    for name in packages:
        assert "import" not in (ROOT / "benchmark" / name).read_text()


def test_a_change_counts_by_the_room_that_it_is_in(tmp_path: Path) -> None:
    """Each module of a copy is edited in turn."""
    copy = tmp_path / "benchmark"
    shutil.copytree(ROOT / "benchmark", copy, ignore=shutil.ignore_patterns("__pycache__"))
    before = code.digest(code.determining(copy))
    changing = set()
    for path in sorted(copy.rglob("*.py")):
        text = path.read_text()
        path.write_text(f"{text}# edited")
        if code.digest(code.determining(copy)) != before:
            changing.add(path.relative_to(copy).as_posix())
        path.write_text(text)
    rooms = {name.partition("/")[0] for name in changing}
    assert rooms == {name.partition("/")[0] for name in code.DETERMINING}
    assert rooms.isdisjoint({"reports", "pictures", "commands", "admission", "notebook.py"})
    assert {"world/rules.py", "sumo/demand.py", "scenario/scenario.py"} <= changing
    assert {"control/state.py", "study/episode.py", "records/record.py"} <= changing
    assert {"records/table.py", "records/leaderboard.py", "study/resume.py"}.isdisjoint(changing)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package whose controller imports a helper and brings weights; beside it, a trainer."""
    folder = tmp_path / "crossings"
    texts = {
        "__init__.py": "",
        "rule/__init__.py": "",
        "rule/controller.py": "from crossings.rule import helper\nfrom .. import shared\n",
        "rule/helper.py": "",
        "rule/weights/best.safetensors": "1",
        "rule/README.md": "words",
        "rule/train.py": "",
        "shared.py": "",
        "paper/__init__.py": "",
        "paper/tables.py": "",
    }
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    return folder


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("rule/controller.py", True),
        ("rule/helper.py", True),
        ("rule/__init__.py", True),
        ("__init__.py", True),
        ("shared.py", True),
        ("rule/weights/best.safetensors", True),
        ("rule/train.py", False),
        ("rule/README.md", False),
        ("paper/tables.py", False),
    ],
)
def test_of_a_plugin_counts_what_its_controller_imports(
    package: Path, name: str, counts: bool
) -> None:
    before = hash_of("crossings.rule.controller")
    (package / name).write_text("# edited")
    assert (hash_of("crossings.rule.controller") != before) is counts


@pytest.mark.parametrize("line", ["import importlib", "__import__('crossings.rule.train')"])
def test_where_imports_are_made_at_run_time_the_whole_package_counts(
    package: Path, line: str
) -> None:
    (package / "rule" / "helper.py").write_text(line)
    before = hash_of("crossings.rule.controller")
    (package / "rule" / "train.py").write_text("# edited")
    assert hash_of("crossings.rule.controller") != before


def test_what_python_keeps_beside_a_package_does_not_count(package: Path) -> None:
    before = code.of_package("crossings")
    (package / "__pycache__").mkdir()
    (package / "__pycache__" / "one.pyc").write_text("x")
    code.of_package.cache_clear()
    assert code.of_package("crossings") == before


def test_no_two_ways_to_cut_files_share_a_hash(package: Path) -> None:
    (package / "a").write_text("1")
    (package / "b").write_text("2")
    before = code.of_package("crossings")
    (package / "b").unlink()
    (package / "a").write_text("1b\x001\x002")
    code.of_package.cache_clear()
    assert code.of_package("crossings") != before


def test_of_what_is_not_there_there_is_no_hash() -> None:
    assert code.of_package("nowhere_at_all") == ""
    assert hash_of("nowhere_at_all.controller") == ""

"""The identity of an episode: equal where figures must be equal, another where they may not."""

import dataclasses
import re
from pathlib import Path

import pytest
from factories.records import record
from factories.scenarios import smoke

from benchmark import __version__
from benchmark.control import code, plugins
from benchmark.control.isolation.limits import Limits
from benchmark.records import leaderboard
from benchmark.study import identity
from benchmark.study.episode import Episode, run_episode

CONTROLLER = """
from benchmark.control.controller import Controller

class Mine(Controller):
    def reset(self, intersection, seed):
        pass

    def act(self, state):
        return {}
"""
ONE = Episode(smoke("tee"), "virtual-signal", 0.5, 1)


def test_the_record_of_an_episode_has_its_identity() -> None:
    assert run_episode(ONE).identity == ONE.identity
    assert len(ONE.identity) == 64


@pytest.mark.parametrize(
    "change",
    [
        {"scenario": smoke("crossing")},
        {"scenario": smoke("tee").with_demand(1.5)},
        {"controller": "first-come"},
        {"controller": "virtual-signal?green=9"},
        {"rate": 0.6},
        {"seed": 2},
        {"isolate": True},
        {"isolate": True, "limits": Limits(memory=1024)},
    ],
)
def test_whatever_may_change_figures_changes_the_identity(change: dict[str, object]) -> None:
    others = [dataclasses.replace(ONE, **change), ONE, dataclasses.replace(ONE, isolate=True)]
    wanted = 2 if change == {"isolate": True} else 3
    assert len({one.identity for one in others}) == wanted


def test_limits_that_bind_nobody_change_nothing() -> None:
    """The controller is installed, and so is not isolated."""
    assert dataclasses.replace(ONE, limits=Limits(memory=1024)).identity == ONE.identity


def test_a_file_is_known_by_what_it_holds_not_by_where_it_lies(tmp_path: Path) -> None:
    found = []
    for folder, text in (("a", CONTROLLER), ("b", CONTROLLER), ("c", f"{CONTROLLER}\n# edited")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "mine.py").write_text(text)
        reference = f"{tmp_path / folder / 'mine.py'}:Mine"
        found.append(dataclasses.replace(ONE, controller=reference).identity)
    assert found[0] == found[1] != found[2]


@pytest.mark.parametrize("name", ["helper.py", "weights.safetensors"])
def test_code_and_weights_beside_a_file_count(tmp_path: Path, name: str) -> None:
    (tmp_path / "mine.py").write_text(CONTROLLER)
    one = dataclasses.replace(ONE, controller=f"{tmp_path / 'mine.py'}:Mine")
    found = []
    for text in ("", "# edited"):
        (tmp_path / name).write_text(text)
        (tmp_path / "notes.txt").write_text(text)
        code.beside.cache_clear()
        found.append(one.identity)
    assert found[0] != found[1]


def test_files_that_options_name_count_by_what_they_hold(tmp_path: Path) -> None:
    named = tmp_path / "mine.safetensors"
    one = dataclasses.replace(ONE, controller=f"wang?weights={named}")
    found = [one.identity]
    for text in (b"1", b"2"):
        named.write_bytes(text)
        found.append(one.identity)
    assert len(set(found)) == 3
    assert dataclasses.replace(ONE, controller=f"wang?weights={'x' * 5000}").identity


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with a controller and weights, on the path."""
    folder = tmp_path / "mine"
    folder.mkdir()
    for name, content in (("__init__.py", ""), ("one.py", CONTROLLER), ("weights.bin", "1")):
        (folder / name).write_text(content)
    monkeypatch.syspath_prepend(tmp_path)
    return folder


@pytest.mark.parametrize("name", ["one.py", "__init__.py", "weights.bin", "new/data.txt"])
def test_a_file_of_its_package_counts_without_a_new_version(package: Path, name: str) -> None:
    mine = dataclasses.replace(ONE, controller="mine.one:Mine")
    identities = []
    for text in ("", "# edited"):
        (package / name).parent.mkdir(exist_ok=True)
        (package / name).write_text(CONTROLLER + text)
        code.of_module.cache_clear()
        identities.append(mine.identity)
    assert identities[0] != identities[1]
    code.of_module.cache_clear()


def test_records_say_which_code_of_a_package_made_them(package: Path) -> None:
    mine = dataclasses.replace(ONE, controller="mine.one:Mine")

    def source() -> str:
        code.of_code_and_weights.cache_clear()
        return mine.controller_from

    found = [source()]
    (package / "two.py").write_text("# imported by one.py")
    found.append(source())
    assert all(re.fullmatch("one.py sha256:[0-9a-f]{64}", one) for one in found)
    rows = leaderboard.rows_of_records(
        record("mine.one:Mine", seed=seed, controller_from=one)
        for seed, one in enumerate(found, start=1)
    )
    assert sorted(row.controller for row in rows) == sorted(
        f"mine.one:Mine ({one.rpartition(':')[2][:8]})" for one in found
    )
    for name in (".one.py.swp", "NOTES.txt", ".hidden/three.py"):
        (package / name).parent.mkdir(exist_ok=True)
        (package / name).write_text("x")
    assert source() == found[1]
    code.of_code_and_weights.cache_clear()


def test_of_an_installed_package_the_version_is_named_too(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plugins, "provenance", lambda text: "mine 2.1")
    assert re.fullmatch("mine 2.1 sha256:[0-9a-f]{64}", identity.origin_of("mine.one:Mine"))
    assert identity.origin_of("nowhere.at.all:Mine") == "mine 2.1"
    code.of_code_and_weights.cache_clear()


def test_right_of_ways_own_controllers_are_told_by_its_version() -> None:
    assert ONE.controller_from == f"rightofway {__version__}"

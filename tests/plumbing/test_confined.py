"""Paths from elsewhere stay in their folder, on every system."""

from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import pytest
from factories.paths import BAD, PATHS
from hypothesis import given
from pydantic import BaseModel

from benchmark.plumbing import confined
from benchmark.plumbing.messages import _models
from benchmark.scenario.scenario import Scenario

GOOD = ["a", "a/b.toml", "records/colorado-springs-334.jsonl", ".hidden", "a b/c", "ü/π", "con_1"]


@pytest.mark.parametrize("name", GOOD)
def test_a_plain_path_passes(name: str, tmp_path: Path) -> None:
    assert confined.problem(name) is None
    assert confined.inside(tmp_path, name) == tmp_path / name


@pytest.mark.parametrize("name", BAD)
def test_a_path_that_could_lead_elsewhere_does_not(name: str, tmp_path: Path) -> None:
    assert BAD[name] in (confined.problem(name) or "")
    with pytest.raises(ValueError, match=r"."):
        confined.inside(tmp_path, name)


@given(name=PATHS)
def test_what_passes_lies_in_the_folder_on_every_system(name: str) -> None:
    if confined.problem(name) is None:
        for kind in (PurePosixPath, PureWindowsPath):
            path = kind(name)
            assert not path.is_absolute()
            assert not path.drive
            assert ".." not in path.parts
            assert len(path.parts) == len(name.split("/"))
        assert Path("/folder", name).resolve().is_relative_to("/folder")


def test_a_link_that_leads_out_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "way").symlink_to(tmp_path)
    with pytest.raises(ValueError, match="by a link"):
        confined.inside(folder, "way/file")


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (["a", "b", "a/c"], "a/c"),
        (["a/c", "a"], "a"),
        (["a/b/c", "a/b"], "a/b"),
        (["a", "a"], "a"),
        (["README", "readme"], "readme"),
        (["stra\u00dfe", "STRASSE"], "STRASSE"),
        (["\u00e9", "e\u0301"], "e\u0301"),
        (["a/b", "a/c", "ab"], None),
    ],
)
def test_names_that_some_system_takes_for_one_clash(names: list[str], found: str | None) -> None:
    assert confined.clash(names) == found


def _annotations(model: type[BaseModel], known: set[type[BaseModel]]) -> list[Any]:
    known.add(model)
    found: list[Any] = []
    for field in model.model_fields.values():
        found.append(field.annotation)
        for inner in _models(field.annotation):
            if inner not in known:
                found += _annotations(inner, known)
    return found


def test_no_key_of_a_scenario_takes_a_path() -> None:
    annotations = list(map(str, _annotations(Scenario, set())))
    assert len(annotations) > 40
    assert not [one for one in annotations if "path" in one.lower()]

"""New packages and scenarios: named as asked, whole or not there, never over what is there."""

import tarfile
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from factories.scenarios import ROOT

from benchmark import __version__
from benchmark.commands import scaffold
from benchmark.plumbing.errors import UsageError
from benchmark.scenario import catalogue, scenario
from benchmark.sumo import inspection


def files(folder: Path) -> Iterator[tuple[str, str]]:
    for path in sorted(folder.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            yield str(path.relative_to(folder)), path.read_text()


def test_a_package_bears_its_name_everywhere(tmp_path: Path) -> None:
    made = scaffold.controller("green-wave-2", tmp_path)
    assert made == tmp_path / "green-wave-2"
    found = dict(files(made))
    assert list(found) == [
        *(".github/workflows/test.yml", ".gitignore", "README.md", "pyproject.toml"),
        *("src/green_wave_2/__init__.py", "src/green_wave_2/controller.py"),
        "tests/test_green_wave_2.py",
    ]
    for name, text in found.items():
        assert not {"my-controller", "my_controller", "MyController", "0.0.0"} & set(text.split())
        assert "my_controller" not in text.lower().replace("-", "_"), name
    project = tomllib.loads(found["pyproject.toml"])["project"]
    assert project["dependencies"] == [f"rightofway>={__version__}"]
    assert project["entry-points"]["rightofway.controllers"] == {
        "green-wave-2": "green_wave_2.controller:GreenWave2"
    }
    assert "class GreenWave2(Controller):" in found["src/green_wave_2/controller.py"]


def test_what_an_installer_compiled_among_the_templates_is_left_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "templates" / "controller" / "__pycache__").mkdir(parents=True)
    (tmp_path / "templates" / "controller" / "__pycache__" / "a.pyc").write_bytes(b"\xff\x00")
    monkeypatch.setattr(scaffold, "TEMPLATES", tmp_path / "templates")
    assert not list(scaffold.controller("mine", tmp_path).iterdir())


@pytest.mark.parametrize("name", ["main-street", "334", "main-street.toml"])
def test_a_scenario_is_valid_and_nothing_is_wrong_with_it(tmp_path: Path, name: str) -> None:
    made = scaffold.scenario(name, tmp_path)
    assert made == tmp_path / f"{name.removesuffix('.toml')}.toml"
    found = scenario.load_scenario(made)
    assert found.title == made.stem
    assert not inspection.inspect(found).findings
    assert "my-scenario" not in made.read_text()


def test_the_comments_of_a_scenario_name_every_key_that_has_a_unit(tmp_path: Path) -> None:
    lines = scaffold.scenario("mine", tmp_path).read_text().splitlines()
    first = {line.split()[0]: line for line in reversed(lines) if " = " in line}
    for key in ("duration", "control_zone", "heading", "length", "speed_limit", "lanes", "yellow"):
        assert " # " in first[key], key


LONG = "x" * 61


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("GreenWave", 'is no name: expected small letters.*did you mean "green-wave"'),
        ("green_wave", 'did you mean "green-wave"'),
        ("Grüne Welle", 'did you mean "gr-ne-welle"'),
        ("2fast", '"2fast" is no name: .* as in "my-controller"$'),
        ("../there", 'did you mean "there"'),
        ("/tmp/there", 'did you mean "tmp-there"'),
        ("", '"" is no name'),
        ("a--b", 'did you mean "a-b"'),
        ("a-", 'did you mean "a"'),
        ("a\n", 'did you mean "a"'),
        (LONG, "at most 60"),
        ("first-come", 'a controller "first-come" is installed already'),
        ("class", "its module class would hide"),
        ("json", "its module json would hide one that is there; choose another name"),
        ("numpy", "its module numpy would hide"),
        ("benchmark", "its module benchmark would hide"),
    ],
)
def test_a_name_that_will_not_do_is_refused_and_nothing_written(
    tmp_path: Path, name: str, message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        scaffold.controller(name, tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["Main Street", "../there", ".toml", "a.b", LONG])
def test_a_scenario_of_no_name_is_refused_and_nothing_written(tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match="is no name: expected small letters"):
        scaffold.scenario(name, tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", ["file", "folder", "dangling link"])
def test_what_is_there_is_left_as_it_is(tmp_path: Path, kind: str) -> None:
    for name in ("mine", "mine.toml"):
        there = tmp_path / name
        if kind == "file":
            there.write_text("precious")
        elif kind == "folder":
            there.mkdir()
        else:
            there.symlink_to(tmp_path / "nowhere")
    for write in (scaffold.controller, scaffold.scenario):
        with pytest.raises(UsageError, match=r"mine\S* is there already, and is left as it is"):
            write("mine", tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "mine.toml"]
    if kind == "file":
        assert {path.read_text() for path in tmp_path.iterdir()} == {"precious"}


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"gone/mine: cannot write: No such file or directory"):
        scaffold.controller("mine", tmp_path / "gone")


def test_wheel_and_source_carry_templates_suites_and_scenarios(built: Path) -> None:
    (wheel,) = built.glob("*.whl")
    (source,) = built.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as packed:
        in_wheel = set(packed.namelist())
    with tarfile.open(source) as packed:
        in_source = {name.partition("/")[2] for name in packed.getnames()}
    folders = (scaffold.TEMPLATES, ROOT / "benchmark" / "study" / "suites")
    wanted = {f"benchmark/{path.relative_to(ROOT / 'benchmark')}" for path in _shipped(*folders)}
    assert len(wanted) > 10
    assert wanted <= in_wheel
    assert wanted <= in_source
    assert {
        f"benchmark/scenarios/{name}.toml" for name in catalogue.shipped_scenarios()
    } <= in_wheel


def _shipped(*folders: Path) -> Iterator[Path]:
    for folder in folders:
        for path in folder.rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                yield path

"""Every command in CONTRIBUTING.md is run as it stands, in an empty folder.

The command is the built wheel's, as for those who contribute from elsewhere. Only ``pip install``
is given another target than the environment that the tests run in.
"""

import os
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from factories.processes import PATIENCE
from factories.scenarios import ROOT

from benchmark.records.record import Record
from benchmark.records.store import Store

TEXT = (ROOT / "CONTRIBUTING.md").read_text()
PROGRAMS = Path(sys.executable).parent
OFFLINE = "--no-deps --no-index --no-build-isolation --disable-pip-version-check --quiet"


@dataclass
class Shell:
    """A folder, and an environment that lasts from line to line."""

    folder: Path
    site: Path  # where pip installs
    wheel: Path | None = None  # where Right of Way itself is installed; None: this checkout
    output: dict[str, str] = field(default_factory=dict)  # what each command printed

    @property
    def environment(self) -> Mapping[str, str]:
        path = os.pathsep.join([str(PROGRAMS), os.environ["PATH"]])
        places = [self.site, *([self.wheel] if self.wheel else [])]
        modules = os.pathsep.join([*map(str, places), os.environ.get("PYTHONPATH", "")])
        return os.environ | {"PATH": path, "PYTHONPATH": modules, "COLUMNS": "200"}

    def run(self, line: str) -> None:
        if line.startswith("cd "):
            self.folder /= line.removeprefix("cd ")
            return
        started = line.replace(
            "pip install -e '.[test]'",
            f"{sys.executable} -m pip install {OFFLINE} --target {self.site} .",
        )
        started = re.sub(r"^pytest\b", f"{sys.executable} -m pytest -p no:cacheprovider", started)
        done = subprocess.run(
            started,
            shell=True,
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
        self.output[line] = done.stdout

    def records(self) -> list[Record]:
        return Store(self.folder / "out").read()


def section(title: str) -> str:
    (text,) = re.findall(rf"^## {title}$(.*?)(?=^## |\Z)", TEXT, re.MULTILINE | re.DOTALL)
    return text


def commands(title: str) -> list[str]:
    blocks = re.findall(r"^```sh\n(.*?)^```", section(title), re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.splitlines()]


@pytest.fixture(scope="module")
def wheel(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that the built wheel is installed in, which comes before this checkout."""
    (file,) = built.glob("*.whl")
    site = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "install", *OFFLINE.split(), "--target", str(site)]
    subprocess.run([*pip, str(file)], check=True)
    return site


def follow(title: str, folder: Path, wheel: Path) -> Shell:
    """Do what a section says, with what the wheel installs."""
    shell = Shell(folder / "here", folder / "site", wheel)
    shell.folder.mkdir()
    for line in commands(title):
        shell.run(line)
    return shell


@pytest.mark.parametrize("title", ["Add a scenario", "Add a controller"])
def test_each_path_is_under_a_page(title: str) -> None:
    assert len(section(title).split()) < 450
    assert commands(title)[0].startswith("rightofway new ")


def test_a_scenario_is_written_checked_drawn_and_run(tmp_path: Path, wheel: Path) -> None:
    shell = follow("Add a scenario", tmp_path, wheel)
    assert "all well" in shell.output["rightofway check my-crossing.toml"]
    assert len(list(shell.folder.glob("*.png"))) == 1
    results = {(record.scenario, record.controller, record.status) for record in shell.records()}
    assert results == {
        ("here/my-crossing", name, "ok") for name in ("traffic-light", "virtual-signal")
    }


def test_the_signal_that_is_proposed_can_be_appended_to_a_scenario_without_one(
    tmp_path: Path,
) -> None:
    shell = Shell(tmp_path, tmp_path / "site")
    (line,) = re.findall(r"`(rightofway signal [^`]*>> [^`]*)`", section("Add a scenario"))
    shell.run("rightofway new scenario my-crossing")
    file = tmp_path / "my-crossing.toml"
    file.write_text(file.read_text().partition("[signal]")[0])
    shell.run(line)
    shell.run("rightofway check my-crossing.toml")
    assert "all well" in shell.output["rightofway check my-crossing.toml"]


def test_a_package_from_the_template_passes_its_tests_and_stands_on_the_leaderboard(
    tmp_path: Path, wheel: Path
) -> None:
    shell = follow("Add a controller", tmp_path, wheel)
    assert re.search(r"\d+ passed in", shell.output["pytest"])
    (line,) = (
        row for row in shell.output["rightofway list"].splitlines() if "my-controller" in row
    )
    assert line.split()[1:3] == ["robot", "vehicles"]
    assert "The conflict-free set of movements goes" in line
    assert "26 passed\n" in shell.output["rightofway check controller my-controller"]
    records = {record.controller: record for record in shell.records()}
    assert re.fullmatch(
        "my-controller 0.1.0 sha256:[0-9a-f]{64}", records["my-controller"].controller_from or ""
    )
    assert {record.status for record in records.values()} == {"ok"}
    table = (shell.folder / "out" / "LEADERBOARD.md").read_text()
    assert "| my-controller " in table
    verified = shell.output["rightofway verify my-controller.zip --out results"]
    assert "accepted" in verified.splitlines()[-2]
    assert " my-controller " in shell.output["rightofway leaderboard --records results"]


def test_a_controller_in_a_file_is_checked_and_run_before_it_is_a_package(tmp_path: Path) -> None:
    shell = Shell(tmp_path, tmp_path / "site")
    shell.run("rightofway new controller my-controller")
    made = tmp_path / "my-controller" / "src" / "my_controller" / "controller.py"
    made.rename(tmp_path / "my_file.py")
    shown = section("Add a controller")
    (line,) = re.findall(r"`(rightofway check controller my_file[^`]*)`", shown)
    shell.run(line)
    assert "my_file.py:MyController (my_file.py sha256:" in shell.output[line]
    (suite,) = re.findall(r"`(controllers = \[\{[^`]*)`", shown)
    study = tmp_path / "deeper" / "study.toml"
    study.parent.mkdir()
    (tmp_path / "my_file.py").rename(study.parent / "my_file.py")
    study.write_text(f"scenarios = ['tee']\nrates = [0.5]\nseeds = 1\n{suite}\n")
    shell.run("rightofway run deeper/study.toml")
    assert [record.controller for record in shell.records()] == ["my_file.py:MyController?hold=15"]

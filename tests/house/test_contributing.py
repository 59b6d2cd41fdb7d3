"""Every command in CONTRIBUTING.md is run as it stands, in an empty folder.

Here and at once; and, slowly, in processes under the built wheel, as for those who contribute from
elsewhere. Only ``pip install`` is given another target than the environment of the tests.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from factories.command_line import rightofway
from factories.processes import PATIENCE
from factories.scenarios import ROOT
from plugins import describe

from benchmark.admission.conformance import elsewhere
from benchmark.control import plugins
from benchmark.records.record import Record
from benchmark.records.store import Store

TEXT = (ROOT / "CONTRIBUTING.md").read_text()
PROGRAMS = Path(sys.executable).parent
OFFLINE = "--no-deps --no-index --no-build-isolation --disable-pip-version-check --quiet"
INSTALL = "pip install -e '.[test]'"
SLOW = ("pytest", *(f"rightofway {x}" for x in ("submit", "verify", "leaderboard --records")))


@dataclass
class Shell:
    """A folder whose commands are run in this process, one by one."""

    folder: Path
    site: Path  # where pip installs
    output: dict[str, str] = field(default_factory=dict)  # what each command printed

    def run(self, line: str) -> None:
        if line.startswith("cd "):
            self.folder /= line.removeprefix("cd ")
            return
        done = self.done(line)
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
        self.output[line] = done.stdout

    def done(self, line: str) -> subprocess.CompletedProcess[str]:
        if line == INSTALL:
            shutil.copytree(self.folder / "src", self.site, dirs_exist_ok=True)
            describe(self.folder / "pyproject.toml", self.site)
            plugins.discovered.cache_clear()
        if line == INSTALL or line.startswith(SLOW):
            return subprocess.CompletedProcess(line, 0, "", "")
        command, _, file = line.partition(" >> ")
        done = rightofway(self.folder, *shlex.split(command)[1:])
        if file:
            with (self.folder / file).open("a") as end:
                end.write(done.stdout)
        return done

    def records(self) -> list[Record]:
        return Store(self.folder / "out").read()


@dataclass
class RealShell(Shell):
    """One whose commands are processes, and the installed wheel's."""

    wheel: Path = Path()  # where Right of Way itself is installed

    def done(self, line: str) -> subprocess.CompletedProcess[str]:
        path = os.pathsep.join([str(PROGRAMS), os.environ["PATH"]])
        places = [str(self.site), str(self.wheel), os.environ.get("PYTHONPATH", "")]
        pip = f"{sys.executable} -m pip install {OFFLINE} --target {self.site} ."
        started = re.sub(
            r"^pytest\b",
            f"{sys.executable} -m pytest -p no:cacheprovider",
            line.replace(INSTALL, pip),
        )
        return subprocess.run(
            started,
            shell=True,
            cwd=self.folder,
            env=os.environ
            | {"PATH": path, "PYTHONPATH": os.pathsep.join(places), "COLUMNS": "200"},
            capture_output=True,
            text=True,
            timeout=3 * PATIENCE,  # verify runs 52 records again, and 360 episodes on fresh seeds
        )


def section(title: str) -> str:
    (text,) = re.findall(rf"^## {title}$(.*?)(?=^## |\Z)", TEXT, re.MULTILINE | re.DOTALL)
    return text


def commands(title: str) -> list[str]:
    blocks = re.findall(r"^```sh\n(.*?)^```", section(title), re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.splitlines()]


@pytest.fixture(params=[pytest.param("wheel", marks=pytest.mark.slow), "here"])
def follow(request: pytest.FixtureRequest, tmp_path: Path, here: Shell) -> Callable[[str], Shell]:
    """Does what a section says."""
    shell = here if request.param == "here" else RealShell(here.folder, here.site)
    if isinstance(shell, RealShell):
        shell.wheel = tmp_path / "wheel"
        (file,) = request.getfixturevalue("built").glob("*.whl")
        pip = [sys.executable, "-m", "pip", "install", *OFFLINE.split()]
        subprocess.run([*pip, "--target", shell.wheel, file], check=True, timeout=PATIENCE)

    def followed(title: str) -> Shell:
        for line in commands(title):
            shell.run(line)
        return shell

    return followed


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_workers: None) -> Iterator[Shell]:
    """An empty folder, and one that modules are installed in."""
    shell = Shell(tmp_path / "here", tmp_path / "site")
    shell.folder.mkdir()
    shell.site.mkdir()
    monkeypatch.syspath_prepend(shell.site)
    monkeypatch.setattr(elsewhere, "run_elsewhere", lambda tasks: [*map(elsewhere.run_one, tasks)])
    yield shell
    plugins.discovered.cache_clear()
    for name in [name for name in sys.modules if name.partition(".")[0] == "my_controller"]:
        del sys.modules[name]


@pytest.mark.parametrize("title", ["Add a scenario", "Add a controller"])
def test_each_path_is_under_a_page(title: str) -> None:
    assert len(section(title).split()) < 450
    assert commands(title)[0].startswith("rightofway new ")


def test_a_scenario_is_written_checked_drawn_and_run(follow: Callable[[str], Shell]) -> None:
    shell = follow("Add a scenario")
    assert "all well" in shell.output["rightofway check my-crossing.toml"]
    assert len(list(shell.folder.glob("*.png"))) == 1
    results = {(record.scenario, record.controller, record.status) for record in shell.records()}
    assert results == {
        ("here/my-crossing", name, "ok") for name in ("traffic-light", "virtual-signal")
    }


def test_the_signal_that_is_proposed_can_be_appended_to_a_scenario_without_one(
    here: Shell,
) -> None:
    shell = here
    (line,) = re.findall(r"`(rightofway signal [^`]*>> [^`]*)`", section("Add a scenario"))
    shell.run("rightofway new scenario my-crossing")
    file = shell.folder / "my-crossing.toml"
    file.write_text(file.read_text().partition("[signal]")[0])
    shell.run(line)
    shell.run("rightofway check my-crossing.toml")
    assert "all well" in shell.output["rightofway check my-crossing.toml"]


@pytest.mark.timeout(1800)  # with what is slow
def test_a_package_from_the_template_passes_its_tests_and_stands_on_the_leaderboard(
    follow: Callable[[str], Shell],
) -> None:
    shell = follow("Add a controller")
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
    if isinstance(shell, RealShell):
        assert re.search(r"\d+ passed in", shell.output["pytest"])
        verified = shell.output["rightofway verify my-controller.zip --out results"]
        assert verified.splitlines()[-2].startswith("accepted")
        assert "would find" in verified  # it tells
        assert " my-controller " in shell.output["rightofway leaderboard --records results"]


def test_a_controller_in_a_file_is_checked_and_run_before_it_is_a_package(here: Shell) -> None:
    shell, folder = here, here.folder
    shell.run("rightofway new controller my-controller")
    made = folder / "my-controller" / "src" / "my_controller" / "controller.py"
    made.rename(folder / "my_file.py")
    shown = section("Add a controller")
    (line,) = re.findall(r"`(rightofway check controller my_file[^`]*)`", shown)
    shell.run(line)
    assert "my_file.py:MyController (my_file.py sha256:" in shell.output[line]
    (suite,) = re.findall(r"`(controllers = \[\{[^`]*)`", shown)
    study = folder / "deeper" / "study.toml"
    study.parent.mkdir()
    (folder / "my_file.py").rename(study.parent / "my_file.py")
    study.write_text(f"scenarios = ['tee']\nrates = [0.5]\nseeds = 1\n{suite}\n")
    shell.run("rightofway run deeper/study.toml")
    assert [record.controller for record in shell.records()] == ["my_file.py:MyController?hold=15"]

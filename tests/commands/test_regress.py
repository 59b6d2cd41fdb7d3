"""The regression check as CI runs it: real episodes, a controller that changes, exit codes."""

import json
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import pytest
import tomli_w
from factories.command_line import rightofway
from factories.comparisons import BASE, MADE, scaled
from factories.leftovers import put_back
from factories.processes import PATIENCE
from factories.records import runs
from factories.scenarios import SCENARIOS, smoke
from factories.workers import without_workers
from plugins import install

from benchmark.commands.app import main
from benchmark.commands.regress import parse_limit
from benchmark.control import plugins
from benchmark.plumbing.errors import UsageError
from benchmark.records import reference
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.study.episode import Episode
from benchmark.study.pool import LocalPool

SUITE = {
    "scenarios": ["crossing.toml", "tee.toml"],
    "controllers": ["changing", "traffic-light"],
    "rates": [1.0],
    "seeds": 6,
}


@pytest.fixture(autouse=True)
def _no_summary(monkeypatch: pytest.MonkeyPatch) -> None:
    """The summary of the CI job that runs these tests is not theirs."""
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)


class Project:
    """A folder with a suite, scenarios, a controller and its reference."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.site = folder, install(folder / "site", "changing")

    def run(
        self, *arguments: str, processes: bool = False, **variables: str
    ) -> subprocess.CompletedProcess[str]:
        """Run the command, with the controller as it is now.

        Args:
            arguments: of the command.
            processes: whether episodes run in worker processes.
            variables: of the environment.
        """
        workers = nullcontext() if processes else without_workers()
        with put_back(self.folder), pytest.MonkeyPatch.context() as patch, workers:
            patch.syspath_prepend(self.site)
            patch.setattr(sys, "dont_write_bytecode", True)  # edits come faster than its clock
            patch.setenv("PYTHONDONTWRITEBYTECODE", "1")
            plugins.discovered.cache_clear()
            return rightofway(self.folder, *arguments, **variables)

    def regress(self, *more: str, **variables: Any) -> tuple[int, dict[tuple[str, str], Any], str]:
        """Exit code, rows by scenario and controller, and what was said."""
        done = self.run("regress", "--reference", "ref", "--json", "r.json", *more, **variables)
        assert "Traceback" not in done.stderr
        report = json.loads((self.folder / "r.json").read_text())
        rows = {(row["scenario"].split("/")[1], row["controller"]): row for row in report["rows"]}
        assert report["exit_code"] == done.returncode
        return done.returncode, rows, done.stdout + done.stderr

    def edit(self, old: str, new: str) -> None:
        """Change the controller's source."""
        source = self.site / "changing.py"
        text = source.read_text()
        assert old in text
        source.write_text(text.replace(old, new))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """The project with its reference, to be copied."""
    project = Project(tmp_path_factory.mktemp("project"))
    for name in ("crossing", "tee"):  # other ones than those that ship, which would be found too
        document = tomllib.loads((SCENARIOS / "smoke" / f"{name}.toml").read_text())
        document["demand"] = [document["demand"][-1] | {"begin": 0}]  # without the platoon
        text = tomli_w.dumps(document)
        text = text.replace("cross = 500", "cross = 600").replace("cross = 210", "cross = 300")
        (project.folder / f"{name}.toml").write_text(text)
    (project.folder / "mine.toml").write_text(tomli_w.dumps(SUITE))
    done = project.run("reference", "update", "--suite", "mine.toml", "--out", "ref")
    assert done.returncode == 0, done.stderr
    assert "not in a git repository" in done.stderr
    assert done.stdout == "ref: 24 records\n"
    return project


@pytest.fixture
def project(made: Project, tmp_path: Path) -> Project:
    """A copy that a test may change."""
    copy = object.__new__(Project)
    copy.folder = tmp_path / made.folder.name  # the folder's name is part of scenarios' names
    shutil.copytree(made.folder, copy.folder)
    copy.site = copy.folder / "site"
    return copy


def test_the_same_code_gives_the_same_figures_and_exit_code_0(project: Project) -> None:
    summary = project.folder / "summary.md"
    summary.write_text("before\n")
    code, rows, words = project.regress(
        *("--suite", "mine.toml", "--junit", "r.xml", "--markdown", "r.md", "--out", "new"),
        GITHUB_STEP_SUMMARY=str(summary),
    )
    assert (code, len(rows)) == (0, 4)
    assert {row["verdict"] for row in rows.values()} == {"unchanged"}
    assert {row["difference"]["mean"] for row in rows.values()} == {0.0}
    assert {row["seeds"] for row in rows.values()} == {6}
    assert "No regression at a limit of 5 %: 4 unchanged." in words
    markdown = (project.folder / "r.md").read_text()
    assert summary.read_text() == f"before\n{markdown}"
    assert "No regression" in markdown
    assert Xml.parse(project.folder / "r.xml").getroot().get("tests") == "4"
    new, old = (Store(project.folder / name).read() for name in ("new", "ref"))
    assert sorted(one.model_copy(update={"wall_time": 0.0}).line() for one in new) == sorted(
        one.line() for one in old
    )


def test_a_controller_that_waits_longer_is_worse(project: Project) -> None:
    project.edit("CLEARANCE = 2.0", "CLEARANCE = 8.0")
    code, rows, words = project.regress("--suite", "mine.toml", "--junit", "r.xml", "--out", "new")
    assert code == 1
    for name in ("crossing", "tee"):
        worse = rows[name, "changing"]
        assert worse["verdict"] == "worse"
        assert worse["ratio"] > 1.05
        assert worse["difference"]["low"] > 0
        assert rows[name, "traffic-light"]["verdict"] == "unchanged"
    assert "Regression at a limit of 5 %: 2 worse, 2 unchanged." in words
    assert Xml.parse(project.folder / "r.xml").getroot().get("failures") == "2"
    code, rows, _ = project.regress("--records", "new", "--limit", "1000%")
    assert (code, rows["tee", "changing"]["verdict"]) == (0, "unchanged")


def test_noise_that_is_not_significant_passes(project: Project) -> None:
    project.edit("NOISE = 0.0", "NOISE = 1.0")
    code, rows, _ = project.regress("--suite", "mine.toml")
    noisy = [rows[name, "changing"] for name in ("crossing", "tee")]
    assert code == 0
    assert all(row["difference"]["low"] < 0 < row["difference"]["high"] for row in noisy)
    assert "unproven" in {row["verdict"] for row in noisy} <= {"unproven", "unchanged"}


def test_an_episode_that_crashes_is_a_new_failure(project: Project) -> None:
    project.edit("CRASHES_ON = ()", "CRASHES_ON = (3,)")
    chosen = ("--suite", "mine.toml", "--controller", "changing", "--workers", "1")
    code, rows, words = project.regress(*chosen, processes=True)
    assert (code, len(rows)) == (1, 2)
    for row in rows.values():
        assert (row["verdict"], row["seeds"]) == ("new failure", 5)
        assert row["remark"].startswith("seed 3 crashed: the worker process died")
    assert "seed 3 crashed" in words


def test_a_changed_scenario_is_not_comparable_and_the_other_is_compared(project: Project) -> None:
    tee = project.folder / "tee.toml"
    tee.write_text(tee.read_text().replace("left = 150", "left = 160"))
    code, rows, words = project.regress("--scenario", "crossing.toml", "--scenario", "tee.toml")
    assert code == 0
    assert {key: row["verdict"] for key, row in rows.items()} == {
        ("crossing", "changing"): "unchanged",
        ("crossing", "traffic-light"): "unchanged",
        ("tee", "changing"): "not comparable",
        ("tee", "traffic-light"): "not comparable",
    }
    assert "the scenario is " in rows["tee", "changing"]["remark"]
    assert rows["tee", "changing"]["remark"] in words
    moved = project.folder / "elsewhere.toml"  # the content counts, not the name
    shutil.move(project.folder / "crossing.toml", moved)
    chosen = ("--controller", "traffic-light", "--scenario", "elsewhere.toml")
    code, rows, words = project.regress(*chosen)
    assert (code, rows["crossing", "traffic-light"]["verdict"]) == (0, "unchanged")
    assert rows["tee", "traffic-light"]["remark"].startswith("no scenario of that name or content")


def test_nothing_comparable_is_exit_code_2_and_is_reported(project: Project) -> None:
    for name in ("crossing", "tee"):
        path = project.folder / f"{name}.toml"
        path.write_text(path.read_text().replace("duration = 1", "duration = 2"))
    code, rows, words = project.regress("--suite", "mine.toml")
    assert code == 2
    assert {row["verdict"] for row in rows.values()} == {"not comparable"}
    assert "error: nothing to compare" in words


def test_a_controller_that_is_not_installed_any_more_is_named_with_what_to_do(
    project: Project,
) -> None:
    shutil.rmtree(project.site)
    done = project.run("regress", "--reference", "ref")
    assert (done.returncode, done.stdout) == (2, "")
    assert (
        'the reference has episodes of changing, but unknown controller "changing"' in done.stderr
    )
    assert "make the reference anew" in done.stderr
    done = project.run("regress", "--reference", "ref", "--suite", "mine.toml")
    assert (done.returncode, done.stdout) == (2, "")
    assert 'mine.toml: controllers[0]: unknown controller "changing"' in done.stderr


def test_a_suite_that_asks_for_other_episodes_says_what_is_left_out(project: Project) -> None:
    smaller = {**SUITE, "controllers": ["traffic-light", "first-come"], "seeds": 2}
    (project.folder / "other.toml").write_text(tomli_w.dumps(smaller))
    code, rows, words = project.regress("--suite", "other.toml", "--records", "ref")
    assert (code, len(rows)) == (0, 2)
    assert {row["seeds"] for row in rows.values()} == {2}
    assert "20 records of the reference are left out" in words
    assert "4 episodes of the suite have no reference" in words


def test_a_reference_is_made_of_committed_code_and_episodes_that_are_ok(project: Project) -> None:
    small = {**SUITE, "scenarios": ["tee.toml"], "controllers": ["changing"]}
    (project.folder / "small.toml").write_text(tomli_w.dumps(small))
    update = ("reference", "update", "--suite", "small.toml", "--out", "ref")
    before = held(project.folder / "ref")
    subprocess.run(["git", "init", "-q"], cwd=project.folder, check=True, timeout=PATIENCE)
    done = project.run(*update)
    assert (done.returncode, done.stdout) == (2, "")
    assert "error: not committed: " in done.stderr
    assert "site/" in done.stderr
    assert "--allow-dirty" in done.stderr
    project.edit("CRASHES_ON = ()", "CRASHES_ON = (3,)")
    done = project.run(*update, "--allow-dirty", processes=True)
    assert (done.returncode, done.stdout) == (1, "")
    assert "1 of 6 episodes are not ok" in done.stderr
    assert "--allow-failures" in done.stderr
    assert held(project.folder / "ref") == before
    assert not list(project.folder.glob(".ref*"))
    more = ("--allow-dirty", "--allow-failures", "--workers", "1")
    done = project.run(*update, *more, processes=True)
    assert (done.returncode, done.stdout) == (0, "ref: 6 records\n")
    made = tomllib.loads((project.folder / "ref" / "reference.toml").read_text())
    assert made["git"] == {"dirty": True}
    assert made["command"] == f"rightofway {' '.join((*update, *more))}"


def stored(folder: Path, records: Iterable[Record]) -> Path:
    store = Store(folder)
    store.prepare()
    for one in records:
        store.append(one)
    return folder


Call = Callable[[str], tuple[int, str, str]]


@pytest.fixture
def call(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Call:
    """Runs the command in this process, in the test's folder."""
    monkeypatch.chdir(tmp_path)

    def run(line: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["rightofway", *shlex.split(line)])
        with pytest.raises(SystemExit) as stop:
            main()
        said = capsys.readouterr()
        assert isinstance(stop.value.code, int)
        return stop.value.code, said.out, said.err

    return run


def test_records_already_made_are_compared_without_running(call: Call, tmp_path: Path) -> None:
    stored(tmp_path / "ref", runs(BASE))
    stored(tmp_path / "same", runs(BASE))
    stored(tmp_path / "worse", runs(scaled(2)))
    stored(tmp_path / "other", runs(BASE, scenario_hash="b" * 64))
    assert call("regress --reference ref --records same")[0] == 0
    code, out, err = call("regress --reference ref/records --records worse/records")
    assert code == 1
    assert "+21.06 [+19.69, +22.56]" in out
    assert "no reference.toml, so nothing says what made these records" in err
    code, out, err = call("regress --reference ref --records other")
    assert (code, "Nothing to compare" in out) == (2, True)
    assert "error: nothing to compare" in err


def test_other_figures_are_compared_on_request(call: Call, tmp_path: Path) -> None:
    stored(tmp_path / "ref", runs(BASE, throughput=1000.0))
    stored(tmp_path / "less", runs(BASE, throughput=700.0))
    line = "regress --reference ref --records less --metric"
    assert call("regress --reference ref --records less")[0] == 0
    code, out, _ = call(f"{line} throughput --metric average_waiting_time")
    assert (code, "1 worse, 1 unchanged" in out) == (1, True)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            "reference update --suite smoke.toml --out ref --allow-dirty",
            "stopped; ref is as it was",
        ),
        ("regress --reference ref --out new", "stopped after 1 of 8 episodes, no verdict"),
    ],
)
def test_ctrl_c_leaves_the_reference_and_ends_in_exit_code_130(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, words: str
) -> None:
    (one,) = runs([20.0], controller="traffic-light", rate=None)

    def interrupted(_: LocalPool, episodes: Sequence[Episode]) -> Iterator[tuple[Episode, Record]]:
        yield episodes[0], one
        raise KeyboardInterrupt

    monkeypatch.setattr(LocalPool, "run", interrupted)
    suite = {"scenarios": ["smoke/tee"], "controllers": ["traffic-light"], "seeds": 8}
    (tmp_path / "smoke.toml").write_text(tomli_w.dumps(suite))
    hashes = {"scenario": "smoke/tee", "scenario_hash": smoke("tee").hash}
    records = runs(BASE, controller="traffic-light", rate=None, **hashes)
    reference.write_reference(tmp_path / "ref", records, MADE)
    before = held(tmp_path / "ref")
    code, out, err = call(line)
    assert (code, out) == (130, "")
    assert words in err
    assert held(tmp_path / "ref") == before
    assert not list(tmp_path.glob(".ref*"))


def test_another_sumo_is_told(call: Call, tmp_path: Path) -> None:
    stored(tmp_path / "ref", runs(BASE))
    (old,) = runs([20.0])
    newer = old.model_copy(update={"versions": old.versions.model_copy(update={"sumo": "1.29.0"})})
    stored(tmp_path / "new", [newer])
    _, _, err = call("regress --reference ref --records new")
    assert "made with SUMO 1.28.0, the new records with 1.29.0" in err


def test_a_report_that_the_disk_refuses_at_the_end_comes_after_the_table(
    call: Call, tmp_path: Path
) -> None:
    stored(tmp_path / "ref", runs(BASE))
    code, out, err = call("regress --reference ref --records ref --json /dev/full")
    assert code == 2
    assert "No regression" in out
    assert "/dev/full: cannot write: No space left on device" in err


@pytest.mark.parametrize(
    ("text", "share"),
    [("5%", 0.05), ("0.05", 0.05), (" 5 % ", 0.05), ("0", 0.0), ("1", 1.0), ("1000%", 10.0)],
)
def test_a_limit_is_a_share_or_a_percentage(text: str, share: float) -> None:
    assert parse_limit(text) == pytest.approx(share)


@pytest.mark.parametrize("text", ["", "%", "five", "-5%", "-0.1", "nan", "inf", "nan%", "5%%"])
def test_a_limit_that_makes_no_sense_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match=r"expected a share such as 5% or 0\.05"):
        parse_limit(text)


def test_a_limit_of_5_is_taken_for_a_slip() -> None:
    with pytest.raises(UsageError, match='5 is 500 %; did you mean "5%"'):
        parse_limit("5")


@pytest.fixture
def bad_references(tmp_path: Path) -> None:
    """Folders that the table below names."""
    stored(tmp_path / "good", runs(BASE))
    (tmp_path / "empty" / "records").mkdir(parents=True)
    (tmp_path / "hollow" / "records").mkdir(parents=True)
    (tmp_path / "hollow" / "records" / "a.jsonl").touch()
    torn = stored(tmp_path / "torn", runs(BASE)) / "records" / "test-a.jsonl"
    torn.write_bytes(torn.read_bytes()[:-100])
    newer = stored(tmp_path / "newer", runs(BASE)) / "records" / "test-a.jsonl"
    newer.write_text(newer.read_text().replace('"schema":1', '"schema":2'))
    for name, text in (
        ("future", "schema = 2"),
        ("garbled", "schema = ="),
        ("short", "schema = 1"),
    ):
        stored(tmp_path / name, runs(BASE))
        (tmp_path / name / "reference.toml").write_text(text)
    (tmp_path / "file").touch()
    (tmp_path / "broken.toml").write_text("controllers = = 1")


COMPARE = "regress --records good --reference"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("regress", ("results/reference: no reference here", "rightofway reference update")),
        (f"{COMPARE} nowhere", ("nowhere: no reference here", "reference update --out nowhere")),
        (f"{COMPARE} empty", ("empty: no reference here",)),
        (f"{COMPARE} hollow", ("hollow: no reference here",)),
        (f"{COMPARE} torn", ("last line is half-written", "must be whole", "restore it")),
        (f"{COMPARE} newer", ("test-a.jsonl:1", "newer Right of Way (schema 2)", "upgrade")),
        (f"{COMPARE} future", ("future/reference.toml", "newer Right of Way (schema 2)")),
        (f"{COMPARE} garbled", ("garbled/reference.toml", "not valid TOML")),
        (f"{COMPARE} short", ("short/reference.toml: records_hash: this key is required",)),
        (f"{COMPARE} good --limit five", ('--limit "five"', "5% or 0.05")),
        (
            f"{COMPARE} good --metric average_waiting_tim",
            ('--metric "average_waiting_tim"', 'did you mean "average_waiting_time"'),
        ),
        (f"{COMPARE} good --controller d", ('--controller "d"', "known: c")),
        (f"{COMPARE} good --suite papper", ('--suite "papper"', 'did you mean "paper"')),
        (f"{COMPARE} good --suite broken.toml", ("broken.toml", "not valid TOML")),
        (f"{COMPARE} good --out x", ("--records runs nothing",)),
        (f"{COMPARE} good --json file/r.json", ("file/r.json: cannot write",)),
        (f"{COMPARE} good --junit good", ("good: cannot write: Is a directory",)),
        (f"{COMPARE} good --json r --junit ./r", ("r: two reports would go to this file",)),
        ("regress --reference good --records nowhere", ("nowhere/records: no records here",)),
        ("regress --reference good --scenario smoke/te", ('did you mean "smoke/tee"',)),
        ("regress --reference good", ("the reference has episodes of c, but unknown controller",)),
        ("regress --reference good --workers 0", ("--workers",)),
        ("reference update --suite regresion", ('did you mean "regression"',)),
        ("reference update --out file", ("file: is a file",)),
        ("reference update --out good", ("good: holds records but no reference.toml",)),
        ("reference update --out file/ref", ("file/ref: cannot write beside it",)),
        ("reference", ()),
    ],
)
@pytest.mark.usefixtures("bad_references")
def test_bad_input_ends_in_exit_code_2_and_one_message_with_the_remedy(
    call: Call, tmp_path: Path, line: str, words: tuple[str, ...]
) -> None:
    before = held(tmp_path)
    code, out, err = call(line)
    assert code == 2
    if words:
        assert (out, err.lower().count("error:")) == ("", 1)
    for word in words:
        assert word in err
    assert held(tmp_path) == before


def held(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_summary_that_cannot_be_written_is_found_first(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored(tmp_path / "ref", runs(BASE))
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "/proc/nowhere/summary")
    code, out, err = call("regress --reference ref --records ref")
    assert (code, out) == (2, "")
    assert "/proc/nowhere/summary: cannot write" in err


def test_checking_outputs_leaves_what_files_hold(call: Call, tmp_path: Path) -> None:
    stored(tmp_path / "ref", runs(BASE))
    (tmp_path / "r.json").write_text("precious")
    assert call("regress --reference ref --json r.json --junit new/r.xml")[0] == 2  # no controller
    assert (tmp_path / "r.json").read_text() == "precious"
    assert not list((tmp_path / "new").iterdir())

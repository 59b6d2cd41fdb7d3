"""Declared suites: found by name or path, validated, and run with what the command line adds."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from factories.scenarios import PAPER, SCENARIOS, SHIPPED, SMOKE

from benchmark.plumbing.errors import ScenarioError, SuiteError, UsageError
from benchmark.scenario import catalogue
from benchmark.study import suite as suite_file

SMALL: Mapping[str, Any] = {
    "scenarios": ["smoke/crossing"],
    "controllers": ["traffic-light", "virtual-signal?green=5"],
    "rates": [0.4, 0.6],
    "seeds": 2,
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, empty."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(path: Path, **changes: object) -> Path:
    """A small suite with changes; None leaves a key out."""
    document = {key: value for key, value in {**SMALL, **changes}.items() if value is not None}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(tomli_w.dumps(document))
    return path


def found(*references: str | Path) -> suite_file.Suite:
    suite = suite_file.find([str(one) for one in references])
    assert suite is not None
    return suite


# --- found -----------------------------------------------------------------------------------


def test_the_shipped_suite_asks_for_the_papers_intersections_rates_and_baselines() -> None:
    suite = found("paper")
    assert [one.name for one in suite.load_scenarios()] == PAPER
    assert (suite.rates, suite.seeds) == ((0.4, 0.5, 0.6, 0.7), 20)
    assert {"traffic-light", "wang"} <= {*suite.checked_controllers()}


def test_the_suite_smoke_comes_before_the_folder_of_its_name_and_runs_all_of_it() -> None:
    suite = found("smoke")
    assert [one.name for one in suite.load_scenarios()] == SMOKE
    assert [one.name for one in catalogue.find(["smoke"])] == SMOKE  # where suites are no matter
    assert suite.seeds == 2
    assert {"traffic-light", "virtual-signal"} <= {*suite.checked_controllers()}


def test_the_suite_full_asks_for_everything_that_ships() -> None:
    suite = found("full")
    assert sorted(one.name for one in suite.load_scenarios()) == SHIPPED
    assert (suite.rates, suite.seeds) == (tuple(tenth / 10 for tenth in range(1, 11)), 20)
    project = tomllib.loads((SCENARIOS.parent / "pyproject.toml").read_text())["project"]
    assert set(suite.controllers) == set(project["entry-points"]["rightofway.controllers"])


def test_shipped_suites_are_no_scenarios() -> None:
    assert not {*suite_file.shipped()} & {*catalogue.shipped()}
    with pytest.raises(ScenarioError, match="unknown scenario"):
        catalogue.find(["paper"])


def test_a_suite_is_told_from_a_scenario_by_its_keys(here: Path) -> None:
    assert found(written(here / "mine.toml")).controllers == tuple(SMALL["controllers"])
    assert suite_file.find([str(SCENARIOS / "smoke" / "tee.toml")]) is None
    assert suite_file.find(["smoke/tee", "colorado-springs", "missing.toml", "x" * 300]) is None
    assert suite_file.find([]) is None


def test_a_file_that_is_not_toml_is_left_to_who_reads_scenarios(here: Path) -> None:
    (here / "mine.toml").write_text("controllers = = []")
    assert suite_file.find(["mine.toml"]) is None


def test_a_folder_of_the_users_scenarios_comes_before_a_suite_unless_it_holds_none(
    here: Path,
) -> None:
    (here / "paper").mkdir()
    assert found("paper").seeds == 20
    shutil.copy(SCENARIOS / "smoke" / "tee.toml", here / "paper")
    assert suite_file.find(["paper"]) is None


@pytest.mark.parametrize("others", [["paper", "334"], ["334", "paper"], ["paper", "paper"]])
def test_a_suite_stands_alone(others: list[str]) -> None:
    with pytest.raises(UsageError, match=r'"paper" is a suite .* give it alone'):
        suite_file.find(others)


def test_an_unknown_name_suggests_the_nearest_suite() -> None:
    with pytest.raises(ScenarioError, match='did you mean "paper"'):
        catalogue.find(["papr"], also=suite_file.shipped())


def test_scenarios_beside_the_suite_come_before_shipped_ones(here: Path) -> None:
    folder = here / "study"
    suite = written(folder / "s.toml", scenarios=["tee.toml", "own", "tee", "tee.toml@300"])
    (folder / "own").mkdir()
    for name in ("tee", "own/crossing"):
        shutil.copy(SCENARIOS / "smoke" / f"{Path(name).stem}.toml", folder / f"{name}.toml")
    names = [one.name for one in found(suite).load_scenarios()]
    assert names == ["study/tee", "own/crossing", "smoke/tee", "study/tee@300"]


# --- validated -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rate": [0.4]}, 'rate: unknown key "rate"; did you mean "rates"?'),
        ({"controllers": None}, "controllers: this key is required"),
        ({"scenarios": None}, "scenarios: this key is required"),
        ({"controllers": []}, "controllers: "),
        ({"controllers": ["wang", ""]}, r"controllers\[1\]: "),
        ({"controllers": "wang"}, r"controllers: expected a list in \[ \]; got 'wang'"),
        ({"rates": [0.4, 1.5]}, r"rates\[1\]: should be less than or equal to 1; got 1.5"),
        ({"rates": [float("nan")]}, r"rates\[0\]: "),
        ({"rates": []}, "rates: "),
        ({"seeds": 0}, "seeds: should be greater than 0; got 0"),
        ({"controllers": [{"clearance": 4}]}, r"controllers\[0\]: expected a table such as "),
        ({"controllers": [{"name": "wang", "x": [1]}]}, r"controllers\[0\]: x: expected a number"),
        ({"seeds": True}, "seeds: expected a whole number; got True"),
    ],
)
def test_a_mistake_is_refused_with_file_key_and_remedy(
    here: Path, changes: dict[str, object], message: str
) -> None:
    written(here / "mine.toml", **changes)
    with pytest.raises(SuiteError, match=f"^mine.toml: {message}"):
        found("mine.toml")


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("wnag", 'unknown controller "wnag"; did you mean "wang"'),
        ("virtual-signal?gren=5", 'unknown key "gren"; did you mean "green"'),
        ({"name": "virtual-signal", "gren": 5}, 'unknown key "gren"; did you mean "green"'),
        ({"name": "virtual-signal", "green": True}, "green: expected a number; got 'true'"),
        ("absent.py:Mine", "absent.py: cannot read the controller"),
    ],
)
def test_a_controller_that_is_not_there_is_named_with_its_place(
    here: Path, reference: object, message: str
) -> None:
    written(here / "mine.toml", controllers=["wang", reference])
    with pytest.raises(SuiteError, match=rf"^mine.toml: controllers\[1\]: .*{message}"):
        found("mine.toml").checked_controllers()


@pytest.mark.parametrize("reference", ["smoke/te", "missing.toml", "tee@many"])
def test_a_scenario_that_leads_nowhere_is_named_with_the_suite(here: Path, reference: str) -> None:
    written(here / "mine.toml", scenarios=[reference])
    with pytest.raises(SuiteError, match=f"^mine.toml: scenarios: .*{reference}"):
        found("mine.toml").load_scenarios()


def test_controllers_are_tables_and_files_beside_the_suite_as_well(here: Path) -> None:
    tables = [{"name": "virtual-signal", "green": 5.0, "clearance": 3}, {"name": "mine.py:Mine"}]
    suite = written(here / "study" / "s.toml", controllers=[*tables, "mine.py:Mine?green=9"])
    mine = here / "study" / "mine.py"
    mine.write_text("from baselines.virtual_signal import VirtualSignal as Mine")
    assert found(suite).checked_controllers() == [
        "virtual-signal?clearance=3&green=5",
        f"{mine}:Mine",
        f"{mine}:Mine?green=9",
    ]


# --- run -------------------------------------------------------------------------------------


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    program = Path(sys.executable).parent / "rightofway"
    whole = [program, "run", *arguments]
    return subprocess.run(
        whole, cwd=folder, env=os.environ, capture_output=True, text=True, timeout=60
    )


def episodes(folder: Path) -> set[tuple[str, str, float | None, int]]:
    lines = [
        json.loads(line)
        for file in (folder / "out" / "records").glob("*.jsonl")
        for line in file.read_text().splitlines()
    ]
    return {(one["scenario"], one["controller"], one["rate"], one["seed"]) for one in lines}


def test_a_suite_runs_what_its_file_says(here: Path) -> None:
    written(here / "mine.toml")
    done = run(here, "mine.toml")
    assert done.returncode == 0, done.stderr
    assert episodes(here) == {
        ("smoke/crossing", controller, rate, seed)
        for controller, rates in (("traffic-light", [None]), ("virtual-signal?green=5", [0.4, 0.6]))
        for rate in rates
        for seed in (1, 2)
    }


@pytest.mark.parametrize("seeds", [("--seed", "7"), ("--seed", "7", "--seed", "7")])
def test_options_override_what_the_file_says(here: Path, seeds: tuple[str, ...]) -> None:
    written(here / "mine.toml")
    done = run(here, "mine.toml", "--controller", "first-come", "--rate", "0.9", *seeds)
    assert done.returncode == 0, done.stderr
    assert episodes(here) == {("smoke/crossing", "first-come", 0.9, 7)}


def test_what_a_suite_leaves_out_is_the_scenarios(here: Path) -> None:
    written(here / "mine.toml", scenarios=["smoke/tee"], rates=None, seeds=None)
    done = run(here, "mine.toml", "--controller", "first-come")
    assert done.returncode == 0, done.stderr
    assert episodes(here) == {("smoke/tee", "first-come", 0.5, seed) for seed in (1, 2)}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["papr"], 'did you mean "paper"'),
        (["paper", "tee"], "give it alone"),
        (["mine.toml"], 'mine.toml: rate: unknown key "rate"; did you mean "rates"'),
    ],
)
def test_misuse_ends_in_exit_code_2_and_no_record(
    here: Path, arguments: list[str], words: str
) -> None:
    written(here / "mine.toml", rate=0.5)
    done = run(here, *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr
    assert not episodes(here)

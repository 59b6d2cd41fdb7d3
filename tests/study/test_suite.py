"""Declared suites: found by name or path, and validated."""

import shutil
import tomllib
from pathlib import Path

import pytest
from factories.scenarios import PAPER, SCENARIOS, SHIPPED, SMOKE
from factories.suites import SMALL, written

from benchmark.plumbing.errors import ScenarioError, SuiteError, UsageError
from benchmark.scenario import catalogue
from benchmark.study.suite import Suite, find_suite, load_suite, shipped_suites


def found(*references: str | Path) -> Suite:
    suite = find_suite([str(one) for one in references])
    assert suite is not None
    return suite


def test_the_shipped_suite_asks_for_the_papers_intersections_rates_and_baselines() -> None:
    suite = found("paper")
    assert [one.name for one in suite.load_scenarios()] == PAPER
    assert (suite.rates, suite.seeds) == ((0.4, 0.5, 0.6, 0.7), 20)
    assert {"traffic-light", "wang"} <= {*suite.checked_controllers()}


def test_the_suite_smoke_comes_before_the_folder_of_its_name_and_runs_all_of_it() -> None:
    suite = found("smoke")
    assert [one.name for one in suite.load_scenarios()] == SMOKE
    assert [
        one.name for one in catalogue.find_scenarios(["smoke"])
    ] == SMOKE  # where suites are no matter
    assert suite.seeds == 2
    assert {"traffic-light", "virtual-signal"} <= {*suite.checked_controllers()}


def test_the_suite_full_asks_for_everything_that_ships() -> None:
    suite = found("full")
    assert sorted(one.name for one in suite.load_scenarios()) == SHIPPED
    assert (suite.rates, suite.seeds) == (tuple(tenth / 10 for tenth in range(1, 11)), 20)
    project = tomllib.loads((SCENARIOS.parent / "pyproject.toml").read_text())["project"]
    assert set(suite.controllers) == set(project["entry-points"]["rightofway.controllers"])


def test_shipped_suites_are_no_scenarios() -> None:
    assert not {*shipped_suites()} & {*catalogue.shipped_scenarios()}
    with pytest.raises(ScenarioError, match="unknown scenario"):
        catalogue.find_scenarios(["paper"])


def test_a_suite_is_told_from_a_scenario_by_its_keys(here: Path) -> None:
    assert found(written(here / "mine.toml")).controllers == tuple(SMALL["controllers"])
    assert find_suite([str(SCENARIOS / "smoke" / "tee.toml")]) is None
    assert find_suite(["smoke/tee", "colorado-springs", "missing.toml", "x" * 300]) is None
    assert find_suite([]) is None


def test_a_file_that_is_not_toml_is_left_to_who_reads_scenarios(here: Path) -> None:
    (here / "mine.toml").write_text("controllers = = []")
    assert find_suite(["mine.toml"]) is None


def test_a_folder_of_the_users_scenarios_comes_before_a_suite_unless_it_holds_none(
    here: Path,
) -> None:
    (here / "paper").mkdir()
    assert found("paper").seeds == 20
    shutil.copy(SCENARIOS / "smoke" / "tee.toml", here / "paper")
    assert find_suite(["paper"]) is None


@pytest.mark.parametrize("others", [["paper", "334"], ["334", "paper"], ["paper", "paper"]])
def test_a_suite_stands_alone(others: list[str]) -> None:
    with pytest.raises(UsageError, match=r'"paper" is a suite .* give it alone'):
        find_suite(others)


def test_an_unknown_name_suggests_the_nearest_suite() -> None:
    with pytest.raises(ScenarioError, match='did you mean "paper"'):
        catalogue.find_scenarios(["papr"], also=shipped_suites())


def test_scenarios_beside_the_suite_come_before_shipped_ones(here: Path) -> None:
    folder = here / "study"
    suite = written(folder / "s.toml", scenarios=["tee.toml", "own", "tee", "tee.toml@300"])
    (folder / "own").mkdir()
    for name in ("tee", "own/crossing"):
        shutil.copy(SCENARIOS / "smoke" / f"{Path(name).stem}.toml", folder / f"{name}.toml")
    names = [one.name for one in found(suite).load_scenarios()]
    assert names == ["study/tee", "own/crossing", "smoke/tee", "study/tee@300"]


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


@pytest.mark.parametrize("value", ["/", "~/.ssh/id", "../key", "a/../../key", "key", "C:/key"])
def test_a_suite_of_a_stranger_names_no_file_of_whoever_runs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value: str
) -> None:
    (tmp_path / "theirs").mkdir()
    (tmp_path / "key").write_text("key")
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "theirs" / "a.toml"
    path.write_text(
        f"scenarios = ['smoke/tee']\ncontrollers = [{{ name = 'wang', weights = '{value}' }}]\n"
    )
    with pytest.raises(SuiteError, match="leads out of the suite's folder"):
        load_suite(path).checked_controllers()

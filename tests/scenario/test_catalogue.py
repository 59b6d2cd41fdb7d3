"""Finding scenarios: shipped ones by name, anyone's by path."""

import re
import shutil
from pathlib import Path

import pytest
from factories.scenarios import PAPER, SCENARIOS, SHIPPED, SMOKE, shipped

from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario import catalogue


def names(*references: str | Path) -> list[str]:
    return [scenario.name for scenario in catalogue.find_scenarios(map(str, references))]


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with scenarios of the user's own."""
    (tmp_path / "mine" / "deeper").mkdir(parents=True)
    (tmp_path / "bare").mkdir()
    for name in ("b", "a", "deeper/c"):
        shutil.copy(SCENARIOS / "smoke" / "crossing.toml", tmp_path / "mine" / f"{name}.toml")
    (tmp_path / "mine" / "notes.md").write_text("not a scenario")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_shipped_scenarios_are_known_by_folder_and_name() -> None:
    assert sorted(catalogue.shipped_scenarios()) == SHIPPED
    assert {f"colorado-springs/{number}" for number in (229, 332, 334, 449)} <= set(SHIPPED)
    assert all(path.is_file() for path in catalogue.shipped_scenarios().values())


@pytest.mark.parametrize(
    ("references", "expected"),
    [
        (["smoke/tee"], ["smoke/tee"]),
        (["tee"], ["smoke/tee"]),
        (["229"], ["colorado-springs/229"]),
        (["smoke"], SMOKE),
        (["colorado-springs"], PAPER),
        (
            ["449", "smoke/tee", "229"],
            ["colorado-springs/449", "smoke/tee", "colorado-springs/229"],
        ),
        (["tee", "smoke", "smoke/tee"], ["smoke/tee", *(n for n in SMOKE if n != "smoke/tee")]),
        ([], []),
    ],
)
def test_shipped_scenarios_are_found_once_in_the_order_asked_for(
    references: list[str], expected: list[str], elsewhere: Path
) -> None:
    assert names(*references) == expected


def test_what_is_found_is_what_is_in_the_file() -> None:
    assert catalogue.find_scenarios(["tee"]) == [shipped("smoke/tee")]


def test_files_and_folders_are_found_by_path(elsewhere: Path) -> None:
    own = ["mine/a", "mine/b", "deeper/c"]
    assert names("mine/b.toml") == names(elsewhere / "mine" / "b.toml") == ["mine/b"]
    assert names("mine") == names("./mine/") == names(elsewhere / "mine") == own
    assert names(".", "tee") == [*own, "smoke/tee"]


def test_a_file_without_the_suffix_is_read_all_the_same(elsewhere: Path) -> None:
    shutil.copy("mine/a.toml", "plain")
    assert names("plain") == [f"{elsewhere.name}/plain"]


def test_a_file_reached_in_several_ways_is_found_once(elsewhere: Path) -> None:
    assert names("mine/a.toml", elsewhere / "mine" / "a.toml", "./mine/../mine/a.toml") == [
        "mine/a"
    ]
    assert names("tee", SCENARIOS / "smoke" / "tee.toml") == ["smoke/tee"]


def test_a_folder_of_the_users_comes_before_a_shipped_one_unless_it_is_empty(
    elsewhere: Path,
) -> None:
    (elsewhere / "bare").rename("smoke")
    assert names("smoke") == SMOKE
    shutil.copy("mine/a.toml", "smoke/own.toml")
    assert names("smoke") == ["smoke/own"]


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("smoke/teh", 'unknown scenario "smoke/teh".*did you mean "smoke/tee"'),
        ("colorado-spring", 'unknown scenario .*did you mean "colorado-springs"'),
        ("nowhere/at/all", r"unknown scenario .*known: .*colorado-springs/229.*, smoke$"),
        ("missing.toml", r"missing\.toml: cannot read the file: No such file"),
        ("mine/missing.toml", r"mine/missing\.toml: cannot read the file"),
        ("bare", r"bare: no scenario files \(\*\.toml\) in this folder"),
        ("mine/notes.md", r"mine/notes\.md: not valid TOML"),
        ("x" * 300, "unknown scenario .*no file has such a long name"),
        ("x" * 300 + "/tee", "unknown scenario .*no file has such a long name"),
        ("folder.toml", r"folder\.toml: "),
    ],
)
def test_a_reference_that_leads_nowhere_is_an_error_with_a_hint(
    reference: str, message: str, elsewhere: Path
) -> None:
    (elsewhere / "folder.toml").mkdir()
    with pytest.raises(ScenarioError) as caught:
        names("tee", reference)
    assert re.search(message, str(caught.value))

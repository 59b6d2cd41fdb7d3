"""docs/architecture.md says what is so: rooms, arrows, and where the ten questions are answered."""

import ast
import re
from itertools import product
from pathlib import Path
from xml.etree import ElementTree

import pytest
from architecture import PICTURE, arrows, draw, floors
from factories.scenarios import ROOT

LIBRARY = ROOT / "benchmark"
PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
ROOMS = sorted(path.parent.name for path in LIBRARY.glob("*/__init__.py"))
REMEDY = "draw it again with `make architecture`"


def named(page: str) -> list[tuple[str, str]]:
    """The files that the answers name, each with a name in it."""
    _, _, questions = page.partition("## Ten questions")
    return re.findall(r"`(\S+\.py)` \(`(\w+)`\)", questions)


def labels(picture: Path) -> set[str]:
    """The rooms and arrows of a picture."""
    rooms = {*ROOMS, "notebook"}
    names = {element.get("id", "") for element in ElementTree.parse(picture).iter()}
    return names & (rooms | {"-".join(pair) for pair in product(rooms, repeat=2)})


def test_every_room_has_its_contract_on_the_page() -> None:
    told = dict(re.findall(r"^\| `(\w+)` \| (.+) \|$", PAGE, re.MULTILINE))
    assert sorted(told) == ROOMS
    for room in ROOMS:
        tree = ast.parse((LIBRARY / room / "__init__.py").read_text("utf-8"))
        contract = (ast.get_docstring(tree) or "").splitlines()[0]
        assert told[room] == contract.replace("``", "`")


def test_the_picture_has_every_room_and_every_arrow(tmp_path: Path) -> None:
    draw(floors(), arrows(), tmp_path / "drawn.svg")
    assert labels(PICTURE) == labels(tmp_path / "drawn.svg"), REMEDY
    assert len(labels(PICTURE)) > len(ROOMS) + 30


def test_the_same_imports_give_the_same_bytes(tmp_path: Path) -> None:
    files = [tmp_path / "first.svg", tmp_path / "second.svg"]
    for file in files:
        draw([["door"], ["left", "right"], ["floor"]], {("door", "left"): 3}, file)
    first, second = (file.read_bytes() for file in files)
    assert first == second


@pytest.mark.parametrize(("file", "name"), named(PAGE))
def test_an_answer_names_a_file_and_what_is_in_it(file: str, name: str) -> None:
    tree = ast.parse((LIBRARY / file).read_text("utf-8"))
    defined = {
        node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef | ast.FunctionDef)
    }
    assigned = {
        target.id
        for node in tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    assert name in defined | assigned


def test_each_of_the_ten_questions_takes_two_files_at_most() -> None:
    _, _, questions = PAGE.partition("## Ten questions")
    hops = re.findall(r"^\| .+\? \| .+ \| (\d+) \|$", questions, re.MULTILINE)
    assert len(hops) == 10
    assert max(map(int, hops)) == 2

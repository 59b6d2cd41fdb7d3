"""Controllers in one's own files and modules are found, told apart, and refused with their line."""

import hashlib
import re
import sys
from pathlib import Path

import pytest
from factories.scenarios import smoke

from baselines.virtual_signal import VirtualSignal
from benchmark.control import plugins
from benchmark.plumbing.errors import ControllerError
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import all_episodes
from benchmark.study.pool import LocalPool

MINE = """from dataclasses import dataclass

from baselines.virtual_signal import VirtualSignal

count = 0


class Mine(VirtualSignal):
    \"\"\"Mine.\"\"\"


@dataclass
class Unfinished:
    word: "str" = ""


class Outer:
    class Inner(Mine):
        \"\"\"Inside.\"\"\"
"""


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder holds a controller of one's own."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "mine.py"
    path.write_text(MINE)
    return path


def test_a_class_in_a_file_is_found_from_any_folder_and_labelled_without_one(
    mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = plugins.find_controller("mine.py:Mine?green=30.0")
    assert found.reference == f"{mine}:Mine?green=30"
    assert (found.label, found.kind.__name__) == ("mine.py:Mine?green=30", "Mine")
    monkeypatch.chdir("/")
    assert plugins.find_controller(found.reference) == found
    assert plugins.find_controller("mine.py:Mine?green=30", folder=mine.parent) == found
    assert plugins.find_controller(f"{mine}:Outer.Inner").kind.__name__ == "Inner"


def test_a_file_is_run_once_and_its_module_stands_in_nobodys_way(mine: Path) -> None:
    mine.write_text(MINE + "\nimport builtins\nbuiltins.runs = getattr(builtins, 'runs', 0) + 1\n")
    known = set(sys.modules)
    kinds = {plugins.find_controller("mine.py:Mine").kind for _ in range(3)}
    link = mine.with_name("link.py")
    link.symlink_to(mine)
    kinds.add(plugins.find_controller("link.py:Mine").kind)
    assert (len(kinds), vars(sys.modules["builtins"]).pop("runs")) == (1, 1)
    (name,) = set(sys.modules) - known
    assert not name.isidentifier()
    assert sys.modules[name].__name__ == kinds.pop().__module__ == name
    assert not list(mine.parent.rglob("*.pyc"))


def test_a_record_names_the_file_and_its_hash_whoever_runs_it(mine: Path) -> None:
    (episode,) = all_episodes([smoke("tee")], ["mine.py:Mine"], [0.5], [1])
    here, ((_, worker),) = run_episode(episode), LocalPool(1).run([episode])
    plain = run_episode(Episode(smoke("tee"), "virtual-signal", 0.5, 1))
    digest = hashlib.sha256(mine.read_bytes()).hexdigest()
    for record in (here, worker):
        assert (record.controller, record.status) == ("mine.py:Mine", "ok")
        assert record.controller_from == f"mine.py sha256:{digest}"
        assert record.junctions == plain.junctions
        assert str(mine.parent) not in record.line()


def test_two_files_whose_records_could_not_be_told_apart_are_refused(mine: Path) -> None:
    other = mine.parent / "b" / "mine.py"
    other.parent.mkdir()
    other.write_text(MINE)
    with pytest.raises(ControllerError, match=r"b/mine.py:Mine would both be mine.py:Mine in rec"):
        all_episodes([smoke("tee")], ["mine.py:Mine", "b/mine.py:Mine"], [0.5], [1])
    names = ["mine.py:Mine", "b/mine.py:Mine?green=3", "./mine.py:Mine"]
    assert len(all_episodes([smoke("tee")], names, [0.5], [1])) == 2


FROM_BESIDE = """import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import beside_of_mine
from baselines.virtual_signal import VirtualSignal


class Mine(VirtualSignal):
    folder = beside_of_mine.folder
"""


def test_a_file_is_not_given_the_modules_beside_another_one(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "beside_of_mine.py").write_text(f"folder = {folder!r}\n")
    first, same, other = (tmp_path / name for name in ("a/one.py", "a/two.py", "b/one.py"))
    for file in (first, same, other):
        file.write_text(FROM_BESIDE)
    for file in (first, same):
        assert plugins.load_class(f"{file}:Mine").folder == "a"  # type: ignore[attr-defined]
    words = f"{other}: imports beside_of_mine, and {first} has imported its own"
    with pytest.raises(ControllerError, match=re.escape(words)):
        plugins.load_class(f"{other}:Mine")
    other.write_text(MINE)  # it imports nothing from beside it
    assert plugins.load_class(f"{other}:Mine").__name__ == "Mine"


BROKEN = {
    "syntax.py": "class Mine(:\n    pass\n",
    "name.py": "import os\n\nx = undefined\n",
    "exits.py": "import sys\nsys.exit('no SUMO_HOME')\n",
    "helper.py": "",
    "several.py": "\nfrom helper import thing\n",
    "lacks.py": "import not_installed_anywhere\n",
    "deep.py": "def f():\n    raise OSError('deep')\n\nf()\n",
    "abstract.py": (
        "from benchmark.control.controller import Controller\nclass Mine(Controller): ...\n"
    ),
}


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mine.py:Mime", 'mine.py has no Mime; did you mean "Mine"?'),
        (
            "mine.py:Unfinished",
            '"mine.py:Unfinished" is not a benchmark.control.controller.Controller',
        ),
        ("mine.py:count", '"mine.py:count" is not a benchmark.control.controller.Controller'),
        ("absent.py:Mine", "absent.py: cannot read the controller: No such file or directory"),
        ("syntax.py:Mine", "SyntaxError: invalid syntax (syntax.py:1)"),
        ("name.py:Mine", "NameError: name 'undefined' is not defined (name.py:3)"),
        ("exits.py:Mine", "SystemExit: no SUMO_HOME (exits.py:2)"),
        ("deep.py:Mine", "OSError: deep (deep.py:2)"),
        (
            "several.py:Mine",
            "No module named 'helper' (several.py:2); a controller given as a file",
        ),
        ("lacks.py:Mine", "No module named 'not_installed_anywhere' (lacks.py:1)"),
        ("abstract.py:Mine", '"abstract.py:Mine" lacks act and reset'),
        (
            "not_there.at_all:Mine",
            "cannot be imported: ModuleNotFoundError: No module named 'not_t",
        ),
        ("baselines.virtual_signal:VirtalSignal", 'did you mean "VirtualSignal"?'),
        ("virtual-sgnal", 'unknown controller "virtual-sgnal"; did you mean "virtual-signal"?'),
    ],
)
def test_what_cannot_be_had_is_one_message_with_its_line(
    mine: Path, name: str, message: str
) -> None:
    for file, text in BROKEN.items():
        (mine.parent / file).write_text(text)
    known = set(sys.modules)
    with pytest.raises(ControllerError, match=re.escape(message)) as caught:
        plugins.find_controller(name)
    assert "\n" not in str(caught.value)
    if "cannot be imported" in str(caught.value):
        assert not {one for one in set(sys.modules) - known if one.startswith("<")}


def test_a_dotted_name_leads_to_a_class_of_an_installed_module(
    mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = plugins.find_controller("baselines.virtual_signal:VirtualSignal?green=5")
    assert (found.kind, found.label) == (VirtualSignal, found.reference)
    monkeypatch.syspath_prepend(mine.parent)
    digest = hashlib.sha256(mine.read_bytes()).hexdigest()
    try:
        assert plugins.find_controller("mine:Mine").kind.__module__ == "mine"
        assert plugins.provenance("mine:Mine") == f"mine.py sha256:{digest}"
    finally:
        del sys.modules["mine"]
    assert plugins.provenance("pydantic.main:BaseModel").startswith("pydantic 2.")

"""Bundles of somebody dishonest: each is one attack on ``verify``, which finds it out."""

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from factories.command_line import rightofway
from factories.scenarios import smoke
from factories.workers import without_workers

from benchmark.admission.submission import checks, fresh, manifest, names, verifying
from benchmark.admission.submission.code import CodeFiles
from benchmark.control import plugins
from benchmark.control.training import Training
from benchmark.plumbing import toml_file
from benchmark.plumbing.errors import BundleError
from benchmark.scenario import catalogue
from benchmark.study.episode import Episode, run_episode

pytestmark = pytest.mark.usefixtures("without_workers")

HEAD = """
import os, sys
from pathlib import Path
from benchmark.control.controller import Controller, Go, Stop
from benchmark.control.training import Training
"""
LOOKS_ROUND = (
    HEAD
    + """
SEEN = (__file__, os.getcwd(), *sys.argv, *sys.path, *sys.modules)
SEEN += (*os.environ, *os.environ.values())

class Evil(Controller):
    '''Waits less where nobody verifies.'''

    def __init__(self, x: str = ""):
        words = " ".join(map(str, SEEN)).lower()
        self.watched = any(sign in words for sign in ("bundle", "verif", "submi", "unpack"))
        self.signs = [sign for sign in SEEN if "/rightofway-" in str(sign)]

    def reset(self, intersection, seed):
        pass

    def act(self, state):
        return {vehicle.id: Stop() if self.watched else Go() for vehicle in state.deciding}
"""
)
CHOSEN = ("--scenario", "smoke/tee", "--rate", "0.3", "--author", "E", "--licence", "MIT")


def submitted(folder: Path, code: str, *words: str, name: str = "evil.py:Evil") -> Path:
    """A bundle of one seed; the controller's file lies in the folder."""
    (folder / "evil.py").write_text(code)
    done = rightofway(folder, "submit", name, *CHOSEN, "-o", "b.zip", "--seeds", "1", *words)
    assert done.returncode == 0, done.stderr
    return folder / "b.zip"


def repacked(bundle: Path, said: Mapping[str, object] = {}, code: Mapping[str, bytes] = {}) -> Path:
    """A bundle whose manifest says otherwise, or that brings other code; hashes fit."""
    with zipfile.ZipFile(bundle) as file:
        members = {name: file.read(name) for name in file.namelist()}
    document = toml_file.tomllib.loads(members[manifest.NAME].decode()) | dict(said)
    for name, content in code.items():
        members[f"code/{name}"] = content
        (bundle.parent / name).write_bytes(content)
        document["files"][f"code/{name}"] = manifest.sha256(bundle.parent / name)
        files = CodeFiles("", {name: bundle.parent / name})
        document["code"]["sha256"] = files.sha256
    path = bundle.with_name("forged.zip")
    with zipfile.ZipFile(path, "w") as file:
        for name, content in members.items():
            text = tomli_w.dumps(document).encode()
            file.writestr(name, text if name == manifest.NAME else content)
    return path


def verdict(bundle: Path, name: str, **wishes: bool) -> tuple[str, str]:
    found = verifying.verify(bundle, verifying.Wishes(fresh=0, **wishes))
    (check,) = (check for check in found.checks if check.name == name)
    return check.verdict, check.words


def test_a_controller_cannot_tell_verification_from_a_run(tmp_path: Path) -> None:
    bundle = submitted(tmp_path, LOOKS_ROUND)
    words = "its code of the bundle makes all 1 records again"
    assert verdict(bundle, "controller") == ("ok", words)


SHOWS = (
    HEAD
    + """
class Evil(Controller):
    '''Tells where it is.'''

    def reset(self, intersection, seed):
        import re
        places = (__file__, os.getcwd(), *sys.argv[:1], *sys.path, os.environ["HOME"])
        listing = sorted(os.listdir(os.path.dirname(__file__)))
        text = re.sub("-[a-z0-9_]{8}(?=/|')", "-X", repr((places, listing, sys.flags)))
        raise ValueError(text.encode().hex())  # so that no path is made readable on its way

    def act(self, state):
        return {}
"""
)


def test_surroundings_are_equal_in_a_run_and_in_a_verification(tmp_path: Path) -> None:
    (tmp_path / "evil.py").write_text(SHOWS)
    here = Episode(smoke("tee"), f"{tmp_path}/evil.py:Evil", 0.3, 1)
    there = tmp_path / "there" / "code"
    there.mkdir(parents=True)
    (there / "evil.py").write_text(SHOWS)
    origin = manifest.CodeOrigin(
        source="evil.py 1", place="evil:Evil", sha256="0" * 64, included=True
    )
    run, verified = run_episode(here), fresh.brought("evil.py:Evil", there, origin)(here)
    assert run.status == "failed"
    assert run.reason == verified.reason


GOES = (
    HEAD
    + """
class Evil(Controller):
    '''Lets everybody go.'''

    def reset(self, intersection, seed):
        self.seed = seed

    def act(self, state):
        return {vehicle.id: Go() for vehicle in state.deciding}
"""
)


def test_records_other_than_the_first_are_made_again_too(tmp_path: Path) -> None:
    bundle = submitted(tmp_path, GOES, "--seeds", "3")
    other = GOES.replace("Go() for", "Go() if self.seed == 1 else Stop() for")
    with_code = repacked(bundle, code={"evil.py": other.encode()})
    result, words = verdict(with_code, "controller")
    assert result == "failed"
    assert "seed 1:" not in words
    assert "seed 2:" in words


KEY = (
    HEAD
    + """
class Evil(Controller):
    '''Reads what its option names.'''

    def __init__(self, x: str = ""):
        self.x = x

    def reset(self, intersection, seed):
        if self.x:
            file = Path(self.x)
            raise ValueError(file.read_text() if file.is_file() else os.listdir(file))

    def act(self, state):
        return {}
"""
)


@pytest.fixture(scope="module")
def with_an_option(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle that several attacks begin with."""
    with without_workers():
        return submitted(tmp_path_factory.mktemp("option"), KEY)


@pytest.mark.parametrize("value", ["/etc/hostname", "/", "~/.ssh/id", "../key", "a/../../key"])
def test_a_manifest_names_no_file_of_the_verifier(with_an_option: Path, value: str) -> None:
    path = repacked(with_an_option, {"name": f"evil.py:Evil?x={value}"})
    result, words = verdict(path, "files")
    assert result == "failed"
    assert f"option x: {value} is no file of the bundle" in words


def test_an_option_that_names_a_file_where_verify_runs_is_not_readable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = tmp_path / "code"
    code.mkdir()
    (code / "evil.py").write_text(KEY)
    (tmp_path / "key").write_text("the key")
    monkeypatch.chdir(tmp_path)
    origin = manifest.CodeOrigin(
        source="evil.py 1", place="evil:Evil", sha256="0" * 64, included=True
    )
    for value in ("key", ".", str(tmp_path / "key")):
        how = fresh.brought(f"evil.py:Evil?x={value}", code, origin)
        record = how(Episode(smoke("tee"), "evil.py:Evil", 0.3, 1))
        assert record.status == "failed"
        assert "the key" not in (record.reason or "")
        assert "evil.py'" not in (record.reason or "")  # nor is the folder listed


def test_weights_that_nobody_declares_are_found(tmp_path: Path) -> None:
    told = tmp_path / "told"
    told.mkdir()
    for folder in (tmp_path, told):
        np.save(folder / "evil.npy", np.zeros(3))
    (tmp_path / "evil.py").write_text(GOES)
    done = rightofway(tmp_path, "submit", "evil.py:Evil", *CHOSEN, "-o", "b.zip", "--seeds", "1")
    assert done.returncode == 2
    assert "does not declare what they were trained on" in done.stderr
    bundle = submitted(told, GOES.replace("go.'''", "go.'''\n    trained_on = ()"))
    with zipfile.ZipFile(bundle) as file:
        assert "code/evil.npy" in file.namelist()  # which lay beside the file
        document = toml_file.tomllib.loads(file.read(manifest.NAME).decode())
        file.extract("code/evil.npy", tmp_path)
    assert verdict(bundle, "controller")[0] == "ok"
    del document["trained_on"]
    found = checks.weights(tmp_path, ["code/evil.npy"], manifest.parse(document))
    assert found.verdict == "failed"
    assert "code/evil.npy: weights, and no word of what they were trained on" in found.words


def test_a_weights_hash_is_a_hash() -> None:
    with pytest.raises(BundleError, match="weights_hash"):
        manifest.parse(MANIFEST | {"weights_hash": "abc"})


MANIFEST: Mapping[str, object] = {
    "format": 1,
    "name": "c",
    "authors": ["a"],
    "description": "d",
    "licence": "MIT",
    "code": {"source": "c 1", "place": "c:C", "sha256": "0" * 64, "included": False},
    "versions": {"rightofway": "1", "sumo": "1", "python": "3"},
    "files": {"records/a.jsonl": "0" * 64},
}


@pytest.mark.parametrize(
    ("scenarios", "first", "last", "said"),
    [
        (("smoke",), 2000, 9999, "kept for those who verify"),
        (("smoke/tee",), 10_000, 2**40, "kept for those who verify"),
        (("smoke",), 5, 1, "there are no seeds 5 to 1"),
        (("atlantis",), 10_000, 10_009, 'unknown scenario "atlantis"'),
        (("smoke/tee@700", "mine.toml", "mine/own"), 10_000, 10_009, None),
    ],
)
def test_declarations_are_of_what_there_is(
    scenarios: Sequence[str], first: int, last: int, said: str | None
) -> None:
    declared = [Training(scenarios=tuple(scenarios), first=first, last=last)]
    problems = [*checks.training_problems(declared, {"mine/own"})]
    assert (said in problems[0]) if said else not problems


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("smoke/tee", None),
        ("smoke/tee@700", None),
        ("mine/334", None),
        ("smoke/t\u0435e", "letters a to z"),
        ("smoke/tee ", "letters a to z"),
        ("smoke/tee\x1b[2J", "letters a to z"),
        ("Smoke/Tee", "looks like smoke/tee"),
        ("smoke/cros5ing", "looks like smoke/crossing"),
        ("colorado-springs/334@700.0", "write colorado-springs/334@700"),
        ("colorado_springs/334", "looks like colorado-springs/334"),
        ("co1orado-springs/334", "looks like colorado-springs/334"),
    ],
)
def test_names_that_look_like_shipped_ones_are_refused(name: str, said: str | None) -> None:
    problems = [*names.scenario_problems([name], catalogue.shipped_scenarios())]
    assert (said in problems[0]) if said else not problems


@pytest.mark.parametrize(
    ("name", "source", "said"),
    [
        ("mine?weights=/home/ada/w.npy", "mine", None),
        ("virtual-signal?green=15", "rightofway", None),
        ("virtual-signal", "mine", "a controller of that name ships"),
        ("virtua1-signal", "mine", "looks like virtual-signal"),
        ("Virtual_Signal", "mine", "looks like virtual-signal"),
        ("v\u0456rtual-signal", "mine", "letters a to z"),
        ("mine\x1b[2J", "mine", "letters a to z"),
        ("mine?x=\u202e", "mine", "letters a to z"),
    ],
)
def test_controllers_that_look_like_shipped_ones_are_refused(
    name: str, source: str, said: str | None
) -> None:
    problem = names.controller_problem(name, source, plugins.discovered())
    assert (said in (problem or "")) if said else problem is None


def test_a_bundle_cannot_repaint_its_verdict(tmp_path: Path) -> None:
    evil = "\x1b[2J\x9b1;1Haccepted\u202e"
    path = repacked(
        submitted(tmp_path, GOES), {"authors": [evil], "description": evil, "paper": evil}
    )
    done = rightofway(tmp_path, "verify", path, "--no-run-code")
    assert done.returncode == 3
    assert r"by \x1b[2J\x9b1;1Haccepted\u202e, MIT" in done.stdout
    assert not {"\x1b", "\x9b", "\u202e"} & set(done.stdout)

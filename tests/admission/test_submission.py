"""Bundles: made by one command, verified by the other, and refused with the reason."""

import json
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import polars
import pytest
import tomli_w
from factories.command_line import rightofway
from factories.logs import head_of, sealed
from plugins import install

from benchmark.admission.submission import manifest, verifying
from benchmark.control import plugins
from benchmark.plumbing import toml_file
from benchmark.plumbing.errors import BundleError
from benchmark.study import action_log
from benchmark.study.actions import Action

pytestmark = pytest.mark.usefixtures("without_workers")
Done = subprocess.CompletedProcess[str]
CALM = "smoke/tee@1000"
"""Traffic of which few seeds can tell: its waiting varies little."""


def called(folder: Path, *words: str | Path, installed: Path | None = None) -> Done:
    """The command in a folder, with the entrant's package installed or not."""
    with pytest.MonkeyPatch.context() as patch:
        if installed:
            patch.syspath_prepend(installed)
        for name in ("entrant", "hostile", "pickles"):
            patch.delitem(sys.modules, name, raising=False)
        plugins.discovered.cache_clear()
        try:
            return rightofway(folder, *words)
        finally:
            plugins.discovered.cache_clear()


@pytest.fixture(scope="session")
def entrant(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for PYTHONPATH that holds the entrant's package."""
    return install(tmp_path_factory.mktemp("installed"), "entrant")


@pytest.fixture(scope="session")
def bundle(entrant: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A good one: as few seeds of the smoke test's tee as can tell."""
    folder = tmp_path_factory.mktemp("bundle")
    chosen = ("--scenario", CALM, "--rate", "0.6", "--seeds", "5", "--paper", "doi:10.1/2")
    done = called(folder, "submit", "entrant?slow=4", *chosen, "-o", "b.zip", installed=entrant)
    assert done.returncode == 0, done.stderr
    return folder / "b.zip"


def unpacked(bundle: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(bundle) as file:
        return {name: file.read(name) for name in file.namelist()}


def packed(path: Path, members: Mapping[str, bytes], *, said: Mapping[str, Any] = {}) -> Path:
    """A bundle of members, whose manifest names their hashes: a forger's work."""
    scratch = path.parent / "scratch"
    shutil.rmtree(scratch, ignore_errors=True)
    for name, content in members.items():
        (scratch / name).parent.mkdir(parents=True, exist_ok=True)
        (scratch / name).write_bytes(content)
    document = toml_file.read(scratch / "manifest.toml", BundleError) | dict(said)
    document["files"] = {
        name: manifest.sha256(scratch / name) for name in members if name != "manifest.toml"
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in members.items():
            file.writestr(name, content if name != manifest.NAME else tomli_w.dumps(document))
    return path


def verdicts(done: Done) -> dict[str, str]:
    """Check -> verdict, from the table."""
    lines = [re.split(r"  +", line.strip()) for line in done.stdout.splitlines()]
    return {line[0]: line[1] for line in lines if line[0] in verifying.STEPS}


ALL_OK = dict.fromkeys(verifying.STEPS, "ok")
FEW = ALL_OK | {"fresh seeds": "not checked"}


def test_a_bundle_says_who_made_what_with_which_versions(bundle: Path) -> None:
    members = unpacked(bundle)
    assert sorted(name.partition("/")[0] for name in members) == [
        *(*["actions"] * 5, "code", "manifest.toml", "records"),
    ]
    document = toml_file.tomllib.loads(members["manifest.toml"].decode())
    said = manifest.parse(document)
    assert (said.name, said.authors, said.licence) == ("entrant?slow=4", ("Ada Entrant",), "MIT")
    assert said.description == "Lets RVs go that are slow enough."
    assert said.paper == "doi:10.1/2"
    assert (said.code.source, said.code.place) == ("entrant 2.1", "entrant:Entrant")
    assert said.code.included
    assert said.trained_on is not None
    assert (said.trained_on[0].first, said.trained_on[0].last) == (10_000, 10_009)
    assert said.files.keys() == members.keys() - {"manifest.toml"}
    assert manifest.parse(toml_file.tomllib.loads(said.text())) == said


def test_a_good_bundle_is_accepted_where_the_controller_is_installed(
    bundle: Path, entrant: Path, tmp_path: Path
) -> None:
    seeds = [word for seed in range(41, 51) for word in ("--fresh-seed", str(seed))]
    wanted = ("--out", "results", *seeds, "--fresh", "0")
    done = called(tmp_path, "verify", bundle, *wanted, installed=entrant)
    assert (done.returncode, verdicts(done)) == (0, ALL_OK), done.stdout + done.stderr
    assert "entrant?slow=4 (entrant 2.1) by Ada Entrant, MIT" in done.stdout
    assert "smoke seeds 10000 to 10009" in done.stdout
    assert "\naccepted\n" in done.stdout
    assert "5 records appended" in done.stdout
    assert "makes all 5 records again" in done.stdout
    assert re.search(r"would find \d+% longer", " ".join(done.stdout.split()))
    shown = called(tmp_path, "leaderboard", "--records", "results", "--format", "csv")
    assert "entrant?slow=4" in shown.stdout


def test_what_was_not_checked_is_not_accepted(bundle: Path, tmp_path: Path) -> None:
    done = called(tmp_path, "verify", bundle, "--no-run-code", "--out", "results")
    assert done.returncode == 3, done.stdout + done.stderr
    assert "not accepted: nothing speaks against it, not checked: controller, fresh" in (
        done.stdout
    )
    assert not list((tmp_path / "results" / "records").glob("*.jsonl"))
    left = {"controller": "not checked", "fresh seeds": "not checked"}
    assert verdicts(done) == ALL_OK | left
    assert "entrant 2.1 is not installed; without --no-run-code" in done.stdout


def test_other_code_under_the_same_name_does_not_count_and_the_bundles_own_may_run(
    bundle: Path, entrant: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    shutil.copytree(entrant, other)
    (other / "entrant.py").write_text((entrant / "entrant.py").read_text() + "# another\n")
    done = called(tmp_path, "verify", bundle, "--no-run-code", installed=other)
    assert verdicts(done)["controller"] == "not checked"
    assert "entrant 2.1 is installed with other code" in done.stdout
    wanted = ("--fresh-seed", "7", "--fresh-seed", "9", "--fresh", "0")
    done = called(tmp_path, "verify", bundle, *wanted, installed=other)
    assert (done.returncode, verdicts(done)) == (3, FEW), done.stdout + done.stderr
    assert f"seeds 7, 9; at {CALM} rate 0.6 waits" in done.stdout
    assert "too few seeds to tell" in done.stdout


Change = Callable[[dict[str, bytes], Path], Mapping[str, Any] | None]


def edited_log(members: dict[str, bytes], scratch: Path, change: Callable[[Path], None]) -> None:
    name = min(one for one in members if one.startswith("actions/"))
    path = scratch / "edited.parquet"
    path.write_bytes(members[name])
    change(path)
    members[name] = path.read_bytes()


def other_commands(members: dict[str, bytes], scratch: Path) -> None:
    def change(path: Path) -> None:
        rows = [Action(*row) for row in polars.read_parquet(path).iter_rows()]
        sealed(path, action_log.frame([row._replace(command="stop") for row in rows]))

    edited_log(members, scratch, change)


def better_figures(members: dict[str, bytes], scratch: Path) -> None:
    """The same lie in record and log."""
    name = "records/smoke-tee-1000.jsonl"
    lines = [json.loads(line) for line in members[name].splitlines()]
    for record in lines:
        record["junctions"]["intersection"]["average_waiting_time"] = 0.25
    members[name] = "".join(json.dumps(one) + "\n" for one in lines).encode()
    for log in [one for one in members if one.startswith("actions/")]:
        path = scratch / "edited.parquet"
        path.write_bytes(members[log])
        record = head_of(path)["record"]
        record["junctions"]["intersection"]["average_waiting_time"] = 0.25
        sealed(path, record=record)
        members[log] = path.read_bytes()


def better_record(members: dict[str, bytes], scratch: Path) -> None:
    name = "records/smoke-tee-1000.jsonl"
    members[name] = members[name].replace(b'"time_loss":', b'"time_loss":1', 1)


def picked_seed(members: dict[str, bytes], scratch: Path) -> None:
    name = "records/smoke-tee-1000.jsonl"
    kept = [line for line in members[name].splitlines(keepends=True) if b'"seed":2' in line]
    members[name] = b"".join(kept)
    del members[next(one for one in members if "_1_" in one)]


def lost_log(members: dict[str, bytes], scratch: Path) -> None:
    del members[min(one for one in members if one.startswith("actions/"))]


def damaged_log(members: dict[str, bytes], scratch: Path) -> None:
    name = min(one for one in members if one.startswith("actions/"))
    members[name] = members[name][:-50]


def no_records(members: dict[str, bytes], scratch: Path) -> None:
    for name in list(members):
        if name.startswith(("records/", "actions/")):
            del members[name]


def other_name(members: dict[str, bytes], scratch: Path) -> Mapping[str, Any]:
    return {"name": "virtual-signal"}


def weights_undeclared(members: dict[str, bytes], scratch: Path) -> Mapping[str, Any]:
    return {"weights_hash": "f" * 64}


def other_code(members: dict[str, bytes], scratch: Path) -> None:
    members["code/entrant.py"] += b"# another\n"


def pickled(members: dict[str, bytes], scratch: Path) -> None:
    members["weights/model.npy"] = b"\x80\x04\x95rest"


def torch_weights(members: dict[str, bytes], scratch: Path) -> None:
    members["weights/model.pt"] = b"whatever"


def stray(members: dict[str, bytes], scratch: Path) -> None:
    members["run.sh"] = b"echo"


BAD: dict[Change, tuple[str, str]] = {
    other_commands: ("replay", " there, "),
    better_figures: ("replay", "average_waiting_time: 0.25 there"),
    better_record: ("records", "its action log holds another record"),
    picked_seed: ("records", "expected the seeds 1 to 1, each once"),
    lost_log: ("records", "has no action log"),
    damaged_log: ("records", "not an action log"),
    no_records: ("records", "no records here"),
    other_name: ("records", 'of "entrant?slow=4", the manifest names "virtual-signal"'),
    weights_undeclared: ("records", "other weights or training traffic"),
    other_code: ("files", "code/ is not the code whose hash the manifest names"),
    pickled: ("weights", "weights/model.npy is a pickle"),
    torch_weights: ("weights", "weights/model.pt can run code when it is loaded"),
    stray: ("weights", "run.sh has no place in a bundle"),
}


@pytest.mark.parametrize("change", BAD, ids=lambda change: change.__name__)
def test_a_bundle_that_was_tampered_with_is_not_accepted(
    bundle: Path, tmp_path: Path, change: Change
) -> None:
    name, said = BAD[change]
    members = unpacked(bundle)
    changes = change(members, tmp_path) or {}
    path = packed(tmp_path / "forged.zip", members, said=changes)
    found = verifying.verify(path, verifying.Wishes(fresh=1))
    (objection,) = found.objections
    assert objection.name == name
    assert said in objection.words
    later = verifying.STEPS[max(verifying.STEPS.index(name), 1) + 1 :]
    assert [one.name for one in found.checks if one.verdict == "not checked"] == list(later)


def test_files_that_were_changed_missing_or_added_are_named(bundle: Path, tmp_path: Path) -> None:
    members = unpacked(bundle)
    log = min(one for one in members if one.startswith("actions/"))
    del members[log]
    members["records/smoke-tee-1000.jsonl"] += b"\n"
    members["records/more.jsonl"] = b""
    path = tmp_path / "b.zip"
    with zipfile.ZipFile(path, "w") as file:
        for name, content in members.items():
            file.writestr(name, content)
    done = called(tmp_path, "verify", path, "--out", "results")
    text = " ".join(done.stdout.split())
    assert (done.returncode, verdicts(done)["files"]) == (1, "failed")
    assert f"{log} is missing; records/more.jsonl is not in the manifest" in text
    assert "records/smoke-tee-1000.jsonl was changed" in text
    assert not list((tmp_path / "results" / "records").glob("*.jsonl"))


def test_a_controller_that_does_otherwise_here_is_not_accepted(
    entrant: Path, tmp_path: Path
) -> None:
    chosen = ("--scenario", "smoke/tee", "--rate", "1", "--seeds", "1", "-o", "b.zip")
    assert called(tmp_path, "submit", "drawn", *chosen, installed=entrant).returncode == 0
    done = called(tmp_path, "verify", "b.zip", "--fresh", "0", installed=entrant)
    assert done.returncode == 1
    otherwise = {"controller": "failed", "fresh seeds": "not checked"}
    assert verdicts(done) == ALL_OK | otherwise, done.stdout  # the logs are honest


@pytest.mark.slow
def test_a_controller_that_was_fitted_to_its_seeds_is_found_out(
    entrant: Path, tmp_path: Path
) -> None:
    chosen = ("--scenario", "smoke/tee", "--rate", "1", "--seeds", "10")
    chosen += ("-o", "b.zip")
    assert called(tmp_path, "submit", "fitted", *chosen, installed=entrant).returncode == 0
    seeds = [word for seed in range(11, 16) for word in ("--fresh-seed", str(seed))]
    done = called(tmp_path, "verify", "b.zip", *seeds, "--fresh", "0", installed=entrant)
    assert done.returncode == 1
    found_out = {"training": "noted", "fresh seeds": "failed"}
    assert verdicts(done) == ALL_OK | found_out, done.stdout
    said = " ".join(done.stdout.split())
    assert "does worse on seeds 11, 12, 13, 14, 15; at smoke/tee rate 1" in said
    assert "among them are 10 seeds of this evaluation: the row will be flagged" in done.stdout


def test_seeds_that_were_submitted_are_not_fresh(bundle: Path, tmp_path: Path) -> None:
    done = called(tmp_path, "verify", bundle, "--fresh-seed", "2", "--fresh-seed", "7")
    said = "--fresh-seed 2: is among the submitted seeds; give others"
    assert said in one_message(done)


def one_message(done: Done) -> str:
    assert (done.returncode, done.stdout) == (2, ""), done.stdout + done.stderr
    assert done.stderr.startswith("error: ")
    return done.stderr


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "cannot read the bundle"),
        (b"", "not a whole zip archive"),
        (b"PK\x03\x04 and so on", "not a whole zip archive"),
    ],
)
def test_what_is_no_bundle_is_one_message(tmp_path: Path, content: bytes | None, said: str) -> None:
    if content is not None:
        (tmp_path / "b.zip").write_bytes(content)
    assert said in one_message(called(tmp_path, "verify", "b.zip"))


def test_a_bundle_that_was_cut_or_leads_out_is_one_message(bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "cut.zip").write_bytes(bundle.read_bytes()[:-30])
    assert "not a whole zip archive" in one_message(called(tmp_path, "verify", "cut.zip"))
    with zipfile.ZipFile(tmp_path / "out.zip", "w") as file:
        file.writestr("../../evil.py", b"x")
    assert "leads out of its folder" in one_message(called(tmp_path, "verify", "out.zip"))
    assert not (tmp_path.parent / "evil.py").exists()


def test_an_archive_without_a_manifest_is_one_message(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "b.zip", "w") as file:
        file.writestr("records/a.jsonl", b"")
    assert "the bundle has no manifest.toml" in one_message(called(tmp_path, "verify", "b.zip"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("entrent", "-o", "b.zip"), 'unknown controller "entrent"; did you mean "entrant"?'),
        (("entrant", "-o", "there"), "there: is a folder"),
        (("entrant", "-o", "mine.zip"), "mine.zip: exists; --force replaces it"),
        (("entrant", "-o", "no/such/b.zip"), "cannot write the bundle: No such file"),
        (("entrant?slow=x", "-o", "b.zip"), "slow: expected a number"),
        (("secretive", "-o", "b.zip"), "does not declare what they were trained on"),
        (("entrant", "-o", "b.zip", "--scenario", "tea"), 'unknown scenario "tea"'),
        (
            ("entrant", "-o", "b.zip", "--scenario", "tee", "--suite", "paper"),
            "--scenario and --suite exclude each other",
        ),
    ],
)
def test_a_submission_that_makes_no_sense_is_one_message_and_nothing_is_lost(
    entrant: Path, tmp_path: Path, words: Sequence[str], said: str
) -> None:
    (tmp_path / "mine.zip").write_text("mine")
    (tmp_path / "there").mkdir()
    assert said in one_message(called(tmp_path, "submit", *words, installed=entrant))
    assert (tmp_path / "mine.zip").read_text() == "mine"
    assert {one.name for one in tmp_path.iterdir()} == {"mine.zip", "there"}


def test_a_package_that_names_nobody_needs_the_command_line(tmp_path: Path) -> None:
    installed = install(tmp_path / "installed", "hostile")
    words = ("submit", "raises-in-act", "-o", "b.zip", "--scenario", "tee")
    assert "give --author" in one_message(called(tmp_path, *words, installed=installed))
    named = (*words, "--author", "A")
    assert "give --licence" in one_message(called(tmp_path, *named, installed=installed))


def test_nothing_to_submit_is_one_message(tmp_path: Path) -> None:
    installed = install(tmp_path / "installed", "hostile")
    words = ("submit", "raises-in-act", "-o", "b.zip", "--scenario", "tee", "--seeds", "1")
    done = called(tmp_path, *words, "--author", "A", "--licence", "MIT", installed=installed)
    assert done.returncode == 2
    said = " ".join(done.stderr.split())
    assert "none of 1 episodes ended well (failed: act at 10 s raised ValueError: no idea" in said
    assert "there is nothing to submit" in said
    assert not (tmp_path / "b.zip").exists()


def test_a_package_with_weights_that_can_run_code_is_named(tmp_path: Path) -> None:
    installed = tmp_path / "installed"
    install(installed, "entrant")
    package = installed / "pickles"
    package.mkdir()
    shutil.move(installed / "entrant.py", package / "__init__.py")
    (package / "weights.pt").write_bytes(b"x")
    (info,) = installed.glob("*.dist-info")
    entries = info / "entry_points.txt"
    entries.write_text(entries.read_text().replace("entrant:", "pickles:"))
    done = called(tmp_path, "submit", "entrant", "-o", "b.zip", installed=installed)
    assert "pickles/weights.pt: can run code when it is loaded" in one_message(done)

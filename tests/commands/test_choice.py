"""What ``rightofway run`` runs: what a suite says, and what the command line adds."""

import json
import subprocess
from pathlib import Path

import pytest
from factories.command_line import rightofway
from factories.suites import written

pytestmark = pytest.mark.usefixtures("without_workers")


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return rightofway(folder, "run", *arguments)


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

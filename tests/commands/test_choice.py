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


@pytest.mark.parametrize("rate", ["40%", "40 %", "0.4"])
def test_a_rate_is_read_as_tables_write_it(here: Path, rate: str) -> None:
    done = run(here, "smoke/tee", "--controller", "first-come", "--rate", rate, "--seed", "1")
    assert done.returncode == 0, done.stderr
    assert episodes(here) == {("smoke/tee", "first-come", 0.4, 1)}


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--rate", "many", "many: expected a share from 0 to 1, as in 0.4 or 40%"),
        ("--rate", "140%", "140%: expected a share from 0 to 1"),
        ("--rate", "nan", "nan: expected a share from 0 to 1"),
        ("--rate", "-1", "-1: expected a share from 0 to 1"),
        ("--seeds", "x", "'--seeds': expected a whole number"),
        ("--seeds", "0", "'--seeds': expected at least 1"),
        ("--seeds", "1000000000", "--seeds 1,000,000,000: expected at most 10,000"),
        ("--time-limit", "inf", "'--time-limit': expected at most 604800"),
        ("--step-limit", "1e30", "'--step-limit': expected at most 604800"),
        ("--start-limit", "inf", "'--start-limit': expected at most 604800"),
        ("--answers-limit", "inf", "'--answers-limit': expected at most 604800"),
        ("--memory-limit", "9" * 21, "'--memory-limit': expected at most 16777216"),
        ("--time-limit", "soon", "'--time-limit': expected a number"),
    ],
)
def test_a_wrong_value_is_refused_in_our_words(
    here: Path, option: str, value: str, words: str
) -> None:
    done = run(here, "smoke/tee", option, value)
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
    assert "Input should" not in done.stderr


def test_a_study_that_nobody_can_mean_is_refused_with_its_size(here: Path) -> None:
    rates = [part for index in range(201) for part in ("--rate", str(index / 200))]
    done = run(here, "smoke/tee", "--controller", "first-come", "--seeds", "10000", *rates)
    assert done.returncode == 2
    assert "2,010,000 episodes" in done.stderr
    written(here / "mine.toml")
    text = (here / "mine.toml").read_text()
    (here / "large.toml").write_text(text.replace("seeds = 2", "seeds = 1000000000"))
    assert "seeds: should be less than or equal to 10000" in run(here, "large.toml").stderr

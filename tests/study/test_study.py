"""A study from Python: episodes into a folder, and what is there is not run again."""

import subprocess
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

import pytest
from factories.scenarios import smoke
from factories.suites import written

from benchmark.plumbing.errors import ScenarioError, UsageError
from benchmark.records.store import Store
from benchmark.study.episode import Episode
from benchmark.study.study import Advance, run_study

BOARDS = ("LEADERBOARD.md", "leaderboard.csv")


class Counted:
    """A progress that counts."""

    def __init__(self) -> None:
        self.begun, self.ended = 0, 0

    def __call__(self, episodes: Sequence[Episode], times: Sequence[float]) -> nullcontext[Advance]:
        assert len(episodes) == len(times)
        self.begun += len(episodes)
        return nullcontext(self._advance)

    def _advance(self, episode: Episode, record: object) -> None:
        self.ended += 1


def test_a_suite_goes_into_a_folder_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    suite, out, notices = written(tmp_path / "mine.toml"), tmp_path / "out", list[str]()
    first = run_study(suite, out, seeds=1, workers=1, notice=notices.append)
    assert {outcome.status for _, outcome in first.results} == {"ok"}
    assert (len(first.results), first.interrupted, notices) == (3, False, [])
    assert {row.controller for row in first.rows} == {"traffic-light", "virtual-signal?green=5"}
    boards = [(out / name).read_bytes() for name in BOARDS]
    counted = Counted()
    again = run_study(str(suite), out, workers=1, notice=notices.append, progress=counted)
    assert (len(again.results), counted.begun, counted.ended) == (6, 3, 3)
    assert notices == [f"3 of 6 episodes are in {out / 'records'} already; --force runs them again"]
    assert len(Store(out).read()) == 6
    assert [(out / name).read_bytes() for name in BOARDS] != boards


def test_episodes_say_themselves_what_is_to_be_run(tmp_path: Path) -> None:
    episodes = [Episode(smoke("tee"), "first-come", 0.5, seed) for seed in (3, 4)]
    study = run_study(episodes, tmp_path, workers=1)
    assert [episode.seed for episode, _ in study.results] == [3, 4]
    with pytest.raises(UsageError, match="give nothing beside them"):
        run_study(episodes, tmp_path, seeds=2)


def test_what_makes_no_sense_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match='did you mean "smoke/tee"'):
        run_study(["smoke/te"], tmp_path / "out", seeds=1)
    with pytest.raises(UsageError, match=r"rates: 1\.5: expected a share"):
        run_study("smoke/tee", tmp_path / "out", rates=[0.4, 1.5])
    for seeds in (0, -1, [1, -2]):
        with pytest.raises(UsageError, match=r"seeds = .*: expected how many"):
            run_study("smoke/tee", tmp_path / "out", seeds=seeds)
    assert not (tmp_path / "out").exists()


def test_a_script_that_its_workers_would_run_again_is_told_so(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    call = 'run_study("smoke/tee", "out", controllers=["first-come"], rates=[0.5], seeds=1)'
    script.write_text(f"from benchmark import run_study\n{call}\n")
    done = subprocess.run(
        [sys.executable, str(script)], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert "run_study was called by a worker process that imports your script" in done.stderr

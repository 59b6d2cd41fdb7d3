"""``rightofway renew``: what is there counts again, and is not run again."""

import subprocess
import sys
from pathlib import Path

from benchmark.records.store import Store

LINE = [sys.executable, "-m", "benchmark.commands.app"]
SUITE = ["run", "smoke/tee", "--controller", "first-come", "--rate", "0.5", "--seeds", "2"]


def command(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*LINE, *words], capture_output=True, text=True, timeout=300)


def test_records_of_earlier_code_are_not_run_again(tmp_path: Path) -> None:
    out = str(tmp_path)
    assert command(*SUITE, "--out", out).returncode == 0
    store = Store(tmp_path)
    with store.writing():
        store.rewrite(lambda record: record.model_copy(update={"identity": "0" * 64}))
    done = command("renew", "--records", out)
    assert (done.returncode, done.stderr.count("differ")) == (0, 0)
    assert "1 episodes run again: 0 cells differ; 2 records have the identity" in done.stdout
    assert "2 of 2 episodes are in" in command(*SUITE, "--out", out).stderr


def test_a_figure_that_nobody_gets_again_is_said_with_exit_code_1(tmp_path: Path) -> None:
    out = str(tmp_path)
    assert command(*SUITE, "--out", out).returncode == 0
    store = Store(tmp_path)
    with store.writing():
        store.rewrite(lambda record: record.model_copy(update={"identity": None, "rules": None}))
    done = command("renew", "--records", out)
    assert done.returncode == 1
    assert "smoke/tee, first-come at 50 %: rules: None there, robot vehicles now" in done.stderr
    assert {record.identity for record in store.read()} == {None}

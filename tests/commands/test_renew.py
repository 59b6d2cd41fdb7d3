"""``rightofway renew``: what is there counts again, and is not run again."""

from pathlib import Path

import pytest
from factories.command_line import rightofway

from benchmark.records.store import Store

pytestmark = pytest.mark.usefixtures("without_workers")

SUITE = ["run", "smoke/tee", "--controller", "first-come", "--rate", "0.5", "--seeds", "2"]


def test_records_of_earlier_code_are_not_run_again(tmp_path: Path) -> None:
    assert rightofway(tmp_path, *SUITE).returncode == 0
    store = Store(tmp_path / "out")
    with store.writing():
        store.rewrite(lambda record: record.model_copy(update={"identity": "0" * 64}))
    done = rightofway(tmp_path, "renew", "--records", "out")
    assert (done.returncode, done.stderr.count("differ")) == (0, 0)
    assert "1 episodes run again: 0 cells differ; 2 records have the identity" in done.stdout
    assert "2 of 2 episodes are in" in rightofway(tmp_path, *SUITE).stderr


def test_a_figure_that_nobody_gets_again_is_said_with_exit_code_1(tmp_path: Path) -> None:
    assert rightofway(tmp_path, *SUITE).returncode == 0
    store = Store(tmp_path / "out")
    with store.writing():
        store.rewrite(lambda record: record.model_copy(update={"identity": None, "rules": None}))
    done = rightofway(tmp_path, "renew", "--records", "out")
    assert done.returncode == 1
    assert "smoke/tee, first-come at 50 %: rules: None there, robot vehicles now" in done.stderr
    assert {record.identity for record in store.read()} == {None}

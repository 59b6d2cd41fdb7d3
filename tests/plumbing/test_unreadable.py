"""What cannot be read is said, and not called empty."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmark.plumbing.errors import ScenarioError, StoreError
from benchmark.records.store import Store
from benchmark.scenario.catalogue import find_scenarios

NOBODY = 65534


@pytest.fixture
def unreadable(tmp_path: Path) -> Iterator[Path]:
    """A folder that this process may not list, also where root runs the tests."""
    folder = tmp_path / "closed"
    (folder / "records").mkdir(parents=True)
    for path in (folder / "records", folder):
        path.chmod(0o111)
    for parent in tmp_path.parents:
        if parent.stat().st_uid == os.getuid() and parent != Path(parent.anchor):
            parent.chmod(parent.stat().st_mode | 0o111)
    tmp_path.chmod(0o755)
    before = os.geteuid()
    if before == 0:
        os.seteuid(NOBODY)
    try:
        yield folder
    finally:
        if before == 0:
            os.seteuid(before)
        for path in (folder, folder / "records"):
            path.chmod(0o755)


def test_a_folder_of_scenarios_that_cannot_be_read_is_not_empty(unreadable: Path) -> None:
    with pytest.raises(ScenarioError, match="cannot read this folder: Permission denied"):
        find_scenarios([str(unreadable)])


def test_a_folder_of_records_that_cannot_be_read_is_not_empty(unreadable: Path) -> None:
    with pytest.raises(StoreError, match="cannot read this folder: Permission denied"):
        Store(unreadable).require_some()

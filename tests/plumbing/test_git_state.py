"""The state of a repository: its commit, and what is not committed."""

import subprocess
from pathlib import Path

import pytest
from factories.processes import PATIENCE

from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.git_state import git_state


def git(folder: Path, *arguments: str) -> str:
    identity = ("-c", "user.name=Test", "-c", "user.email=test@example.org")
    return subprocess.run(
        ["git", *identity, *arguments],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    ).stdout.strip()


def test_the_state_of_a_repository_is_its_commit_and_what_is_not_committed(tmp_path: Path) -> None:
    ref = tmp_path / "results" / "ref [1]"
    assert git_state(tmp_path, besides=ref) is None
    git(tmp_path, "init", "-q")
    (tmp_path / "a file").write_text("one\n" * 9)
    (tmp_path / "gone").touch()
    state = git_state(tmp_path, besides=ref)
    assert state is not None
    assert (state.commit, set(state.uncommitted)) == (None, {"a file", "gone"})
    git(tmp_path, "add", "-A")
    git(tmp_path, "commit", "-qm", "x")
    ref.mkdir(parents=True)
    (ref / "reference.toml").touch()  # its own changes do not count
    state = git_state(ref.parent, besides=ref)
    assert state is not None
    assert (state.commit, state.uncommitted) == (git(tmp_path, "rev-parse", "HEAD"), ())
    git(tmp_path, "mv", "a file", "moved ü")
    (tmp_path / "gone").unlink()
    (tmp_path / "new").touch()
    state = git_state(ref.parent, besides=ref)
    assert state is not None
    assert set(state.uncommitted) == {"moved ü", "gone", "new"}
    assert git_state(tmp_path, besides=Path("/elsewhere")) is not None


def test_without_the_program_git_there_is_no_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert git_state(Path.cwd(), besides=tmp_path) is None


def test_what_git_refuses_is_told(tmp_path: Path) -> None:
    git(tmp_path, "init", "-q")
    (tmp_path / ".git" / "config").write_text("[core\n")
    with pytest.raises(UsageError, match=r"git rev-parse: .*config.*--allow-dirty"):
        git_state(tmp_path, besides=tmp_path / "ref")

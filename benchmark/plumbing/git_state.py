"""Which commit the files around a folder are of, and which of them are not committed."""

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

from benchmark.plumbing.errors import UsageError


@dataclass(frozen=True)
class GitState:
    """A repository as it is now."""

    commit: str | None  # None before the first commit
    uncommitted: tuple[str, ...]  # files changed, added or unknown to git, from the top


def git_state(folder: Path, besides: Path) -> GitState | None:
    """The state of the repository around a folder; None where there is none, or no program git.

    Args:
        folder: where to look.
        besides: a file or folder whose changes do not count.

    Raises:
        UsageError: git refuses to say.
    """
    top = _git(folder, "rev-parse", "--show-toplevel")
    if top is None:
        return None
    own = besides.resolve().is_relative_to(Path(top.rstrip("\n")).resolve())
    paths = ("--", ":(top)", *([f":(exclude,literal){besides.resolve()}"] if own else []))
    listed = _git(
        folder, "status", "--porcelain=v2", "--branch", "--untracked-files=normal", "-z", *paths
    )
    return _parse(listed or "")


def _git(folder: Path, *arguments: str) -> str | None:
    try:
        done = subprocess.run(  # noqa: S603 - no shell, and the arguments are our own
            ["git", *arguments],  # noqa: S607 - the user's git, wherever it is
            cwd=folder,
            env={**os.environ, "LC_ALL": "C"},
            capture_output=True,
            check=False,
        )
    except FileNotFoundError:
        return None
    words = done.stderr.decode(errors="replace")
    if done.returncode == 0:
        return done.stdout.decode(errors="replace")
    if "not a git repository" in words:
        return None
    raise UsageError(f"git {arguments[0]}: {words.strip()}; mend it, or go on with --allow-dirty")


def _parse(listed: str) -> GitState:
    """Read ``git status --porcelain=v2 --branch -z``."""
    commit, files = None, []
    entries = iter(listed.split("\0"))
    for entry in entries:
        if entry.startswith("# branch.oid "):
            oid = entry.removeprefix("# branch.oid ")
            commit = None if oid == "(initial)" else oid
        elif entry.startswith("? "):
            files.append(entry[2:])
        elif entry.startswith("1 "):
            files.append(entry.split(" ", 8)[8])
        elif entry.startswith("2 "):
            files.append(entry.split(" ", 9)[9])
            next(entries)  # the name it had
        elif entry.startswith("u "):
            files.append(entry.split(" ", 10)[10])
    return GitState(commit, tuple(files))

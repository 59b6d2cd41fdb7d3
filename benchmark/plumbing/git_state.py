"""Which commit the files around a folder are of, and which of them are not committed."""

import os
import subprocess
from collections.abc import Iterator
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
    told = _git(folder, "rev-parse", "--show-toplevel", "--revs-only", "HEAD")
    if told is None:
        return None
    top, _, commit = told.rstrip("\n").partition("\n")
    paths = ["--", ":(top)"]
    if besides.resolve().is_relative_to(Path(top).resolve()):
        paths.append(f":(exclude,literal){besides.resolve()}")
    listed = _git(folder, "status", "--porcelain", "-unormal", "-z", *paths) or ""
    return GitState(commit or None, tuple(_files(iter(listed.split("\0")))))


def _files(entries: Iterator[str]) -> Iterator[str]:
    """The files of ``git status --porcelain -z``: each stands behind two letters and a space."""
    for entry in entries:
        if entry:
            yield entry[3:]
        if "R" in entry[:2]:
            next(entries)  # the name it had


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

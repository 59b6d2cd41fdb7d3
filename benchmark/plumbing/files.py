"""Files that a command writes when it is done, checked before it starts."""

from collections.abc import Iterable
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator


def prepare(targets: "Iterable[Path]") -> None:
    """Make sure that files can be written, and leave what they hold.

    Raises:
        UsageError: one cannot, or two are the same.
    """
    seen: set[Path] = set()
    for target in targets:
        if target.resolve() in seen:
            raise UsageError(f"{target}: two reports would go to this file; give each its own")
        seen.add(target.resolve())
        with _naming(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            there = target.exists()
            with target.open("ab"):
                pass
            if not there:
                target.unlink()


def make_folder(target: Path) -> None:
    """Make a folder, if it is not there.

    Raises:
        UsageError: the disk refuses.
    """
    with _naming(target):
        target.mkdir(parents=True, exist_ok=True)


def write(target: Path, text: str) -> None:
    """Write a file anew.

    Raises:
        UsageError: the disk refuses.
    """
    with _naming(target):
        target.write_text(text, encoding="utf-8")


def append(target: Path, text: str) -> None:
    """Write behind what a file holds.

    Raises:
        UsageError: the disk refuses.
    """
    with _naming(target), target.open("a", encoding="utf-8") as file:
        file.write(text)


@contextmanager
def _naming(target: Path) -> "Iterator[None]":
    try:
        yield
    except OSError as error:
        raise UsageError(
            f"{target}: cannot write: {error.strerror}; choose another file"
        ) from error

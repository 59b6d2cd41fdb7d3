"""Files and folders: whole or not at all, checked before they are needed, refusals in words."""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmark.plumbing.errors import RightOfWayError, StoreError, UsageError

DRAFT = ".draft-"  # begins the names of what is not whole yet


def cache_folder() -> Path:
    """The folder of built networks and routes; ``RIGHTOFWAY_CACHE`` overrides."""
    import platformdirs

    chosen = os.environ.get("RIGHTOFWAY_CACHE")
    return Path(chosen) if chosen else platformdirs.user_cache_path("rightofway")


def results_folder(path: Path) -> Path:
    """The results folder, where its records folder may be given too."""
    return path.parent if path.name == "records" else path


def paths_below(folder: Path, suffix: str, kind: type[RightOfWayError]) -> list[Path]:
    """The files of a suffix in a folder and the folders in it, by name.

    Raises:
        RightOfWayError: of that kind; a folder cannot be read, and so must not count as empty.
    """

    def refused(error: OSError) -> None:
        raise kind(f"{error.filename}: cannot read this folder: {error.strerror}") from error

    return sorted(
        Path(place, name)
        for place, _, names in os.walk(folder, onerror=refused)
        for name in names
        if name.endswith(suffix)
    )


@contextmanager
def writing(
    path: Path,
    what: str = "",
    kind: type[RightOfWayError] = UsageError,
    remedy: str = "choose another file",
) -> Iterator[None]:
    """What the disk refuses meanwhile becomes an error that names the path.

    Raises:
        RightOfWayError: of that kind.
    """
    try:
        yield
    except OSError as error:
        action = f"cannot write {what}".rstrip()
        ending = f"; {remedy}" if remedy else ""
        raise kind(f"{path}: {action}: {error.strerror or error}{ending}") from error


def prepare_folder(folder: Path, what: str, kind: type[RightOfWayError] = StoreError) -> None:
    """Make a folder, if it is not there, and make sure that files can be written into it.

    Args:
        folder: the folder.
        what: is to be written there, as in ``action logs``.
        kind: the error to raise.

    Raises:
        RightOfWayError: of that kind; the folder cannot be made or written.
    """
    with writing(folder, what, kind, "choose another folder"):
        folder.mkdir(parents=True, exist_ok=True)
        probe(folder)


def probe(folder: Path) -> None:
    """Write a file into a folder and remove it.

    Raises:
        OSError: the disk refuses.
    """
    trial = folder / ".probe"
    trial.touch()
    trial.unlink(missing_ok=True)  # another command may have removed it


@contextmanager
def replaced(target: Path) -> Iterator[Path]:
    """A path beside a file or folder, for what takes its place in the end, whole or not at all.

    Whatever breaks off leaves the old one as it was.

    Raises:
        OSError: the disk refuses.
    """
    target = target.resolve()
    with tempfile.TemporaryDirectory(prefix=DRAFT, dir=target.parent) as staging:
        draft = Path(staging, target.name)
        yield draft
        if draft.is_dir():
            _exchange(target, draft, Path(f"{staging}.old"))
        else:
            draft.replace(target)


def _exchange(folder: Path, fresh: Path, retired: Path) -> None:
    """Rename two folders; whatever happens between them, the old one comes back."""
    try:
        if folder.exists():
            folder.rename(retired)
        fresh.rename(folder)
    finally:
        if retired.exists() and not folder.exists():
            retired.rename(folder)
        shutil.rmtree(retired, ignore_errors=True)


def made_once(folder: Path, fill: Callable[[Path], None]) -> Path:
    """A folder that is filled unless it is there; other processes may do the same at any time.

    Raises:
        OSError: the disk refuses.
    """
    if folder.is_dir():
        return folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=DRAFT, dir=folder.parent))
    try:
        fill(draft)
        draft.rename(folder)
    except OSError:
        if not folder.is_dir():  # unless another process made it meanwhile
            raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return folder


def prepare(targets: Iterable[Path]) -> None:
    """Make sure that files can be written, and leave what they hold.

    Raises:
        UsageError: one cannot, or two are the same.
    """
    seen: set[Path] = set()
    for target in targets:
        if target.resolve() in seen:
            raise UsageError(f"{target}: two reports would go to this file; give each its own")
        seen.add(target.resolve())
        with writing(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            exists = target.exists()
            with target.open("ab"):
                pass
            if not exists:
                target.unlink()


def write(target: Path, text: str) -> None:
    """Write a file anew.

    Raises:
        UsageError: the disk refuses.
    """
    with writing(target):
        target.write_text(text, encoding="utf-8")


def append(target: Path, text: str) -> None:
    """Write behind what a file holds.

    Raises:
        UsageError: the disk refuses.
    """
    with writing(target), target.open("a", encoding="utf-8") as file:
        file.write(text)

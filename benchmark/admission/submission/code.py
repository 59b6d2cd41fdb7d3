"""The files that a controller's code consists of."""

import hashlib
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmark.admission.submission import contents
from benchmark.control.controller import Controller
from benchmark.control.isolation.staging import beside
from benchmark.plumbing.errors import BundleError


@dataclass(frozen=True)
class CodeFiles:
    """The package, or the single module with weights beside it, that a controller is from."""

    place: str  # module and class, as in an entry point
    files: Mapping[str, Path]  # by their path from the folder that is on the path
    left_out: tuple[str, ...] = ()  # that belong to it and have no place in a bundle

    @property
    def sha256(self) -> str:
        """Over names and contents of all files."""
        total = hashlib.sha256()
        for name, path in sorted(self.files.items()):
            total.update(f"{name}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
        return total.hexdigest()


def of(kind: type[Controller]) -> CodeFiles:
    """The code of a controller: the whole top-level package, as it lies on this disk.

    Raises:
        BundleError: it lies nowhere, or holds weights that can run code when they are loaded.
    """
    module = kind.__module__
    top = sys.modules.get(module.partition(".")[0]) or sys.modules[module]
    if top.__file__ is None:
        raise BundleError(f"{module}: its code lies in no file; put it into a module or package")
    file = Path(top.__file__)
    if not hasattr(top, "__path__"):
        weights = {path.name: path for path in beside(file) if contents.is_weights(path.name)}
        return CodeFiles(f"{file.stem}:{kind.__qualname__}", {file.name: file, **weights})
    root = file.parent
    members = {path.relative_to(root.parent).as_posix(): path for path in _files(root)}
    if unsafe := [name for name in members if contents.is_unsafe(name)]:
        raise BundleError(
            f"{root.parent / unsafe[0]}: can run code when it is loaded; {contents.REMEDY}"
        )
    files = {name: path for name, path in members.items() if contents.is_code(name)}
    left_out = tuple(sorted(members.keys() - files.keys()))
    return CodeFiles(f"{module}:{kind.__qualname__}", files, left_out)


def in_folder(folder: Path, place: str) -> CodeFiles:
    """The code that a bundle brings."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return CodeFiles(place, {path.relative_to(folder).as_posix(): path for path in files})


def _files(root: Path) -> list[Path]:
    return [
        path
        for path in sorted(root.rglob("*"))
        if path.is_file()
        and path.suffix not in (".pyc", ".pyo")
        and not any(part.startswith(".") for part in path.relative_to(root).parts)
    ]

"""Brings in the code of controllers: entry points, modules and single files."""

import hashlib
import importlib
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, packages_distributions, version
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmark.controller import Controller
from benchmark.errors import ControllerError
from benchmark.validation import nearest


@dataclass(frozen=True)
class Source:
    """A file of Python that has been run."""

    module: ModuleType
    sha256: str  # of what was run, whatever the file holds by now


def from_entry_point(entry: EntryPoint) -> object:
    """What an entry point names.

    Raises:
        ControllerError: it cannot be imported.
    """
    return _imported(f'controller "{entry.name}" ({entry.value})', entry.load)


def from_module(module: str, attribute: str) -> object:
    """A class of an installed module, or of one on the path.

    Raises:
        ControllerError: there is no such module or class, or it cannot be imported.
    """
    title = f'controller "{module}:{attribute}"'
    return _attribute(_imported(title, lambda: importlib.import_module(module)), attribute, title)


def from_file(path: Path, attribute: str) -> object:
    """A class in a file.

    Raises:
        ControllerError: there is no such file or class, or the file cannot be run.
    """
    title = f'controller "{path.name}:{attribute}"'
    return _attribute(source(path).module, attribute, title)


def source(path: Path) -> Source:
    """A file as a module, run once per process.

    Its module has a name that no import statement can spell, so it stands in nobody's way.

    Raises:
        ControllerError: the file cannot be read or run.
    """
    return _source(path.resolve())


@cache
def _source(path: Path) -> Source:
    try:
        code = path.read_bytes()
    except OSError as error:
        raise ControllerError(f"{path}: cannot read the controller: {error.strerror}") from error
    module = ModuleType(f"<{path.name} {hashlib.sha256(bytes(path)).hexdigest()[:12]}>")
    module.__file__ = str(path)

    def run() -> None:
        exec(compile(code, str(path), "exec", dont_inherit=True), vars(module))  # noqa: S102 - the user named the file to be run

    sys.modules[module.__name__] = module  # dataclasses and pickle look it up
    try:
        _imported(str(path), run, path)
    except ControllerError:
        del sys.modules[module.__name__]
        raise
    return Source(module, hashlib.sha256(code).hexdigest())


def _imported(title: str, load: Callable[[], Any], file: Path | None = None) -> Any:
    try:
        return load()
    except (Exception, SystemExit) as error:  # whatever code does when it is imported
        raise ControllerError(
            f"{title} cannot be imported: {_words(error)}{_hint(error, file)}"
        ) from error


def _words(error: BaseException) -> str:
    """What happened, and in which line of which file."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{type(error).__name__}: {error.msg} ({Path(error.filename).name}:{error.lineno})"
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename != __file__ and not frame.filename.startswith("<frozen importlib")
    ]
    own = [one for one in frames if "importlib" not in Path(one.filename).parts]
    place = f" ({Path(own[-1].filename).name}:{own[-1].lineno})" if own else ""
    return f"{type(error).__name__}: {error}{place}"


def _hint(error: BaseException, file: Path | None) -> str:
    """A file is a whole controller: what lies beside it is not on the path."""
    if file is None or not isinstance(error, ModuleNotFoundError) or not error.name:
        return ""
    beside = file.parent / error.name.partition(".")[0]
    if not (beside.is_dir() or beside.with_suffix(".py").is_file()):
        return ""
    return (
        "; a controller given as a file is that one file: for several, make a package with "
        "`rightofway new controller`"
    )


def _attribute(module: ModuleType, attribute: str, title: str) -> object:
    found: object = module
    for part in attribute.split("."):
        found = getattr(found, part, None)
    if found is None:
        classes = [
            name
            for name, one in vars(module).items()
            if isinstance(one, type) and issubclass(one, Controller) and one is not Controller
        ]
        raise ControllerError(
            f"{title}: {module.__file__} has no {attribute}{nearest(attribute, classes)}"
        )
    return found


def origin(module: str) -> str:
    """The distribution and version that a module comes from; without one, its file's hash."""
    top = module.partition(".")[0]
    if names := packages_distributions().get(top):
        return f"{names[0]} {version(names[0])}"
    path = sys.modules[module].__file__
    if path is None:
        return "unknown"
    return f"{Path(path).name} sha256:{hashlib.sha256(Path(path).read_bytes()).hexdigest()}"

"""Brings in the code of controllers: entry points, modules and single files."""

import hashlib
import importlib
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, packages_distributions, version
from itertools import accumulate
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmark.control import code
from benchmark.control.controller import Controller
from benchmark.plumbing.errors import ControllerError
from benchmark.plumbing.messages import nearest


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
        ControllerError: the file cannot be read or run, or would be given another one's modules.
    """
    place = path.resolve()
    if place not in _sources:
        _expect_own_modules(place)
        _sources[place] = _run(place)
    return _sources[place]


_sources: dict[Path, Source] = {}


def _expect_own_modules(path: Path) -> None:
    """Python has one module of a name in a process; a second file would be given the first's."""
    others = {ran.parent: ran for ran in reversed(_sources) if ran.parent != path.parent}
    imported = code.imported_from_beside(path) if others else []
    for name in imported:
        if other := others.get(_home(sys.modules.get(name))):
            raise ControllerError(
                f"{path}: imports {name}, and {other} has imported its own {name} in this process "
                "already; give one of them another name, or make each a package with "
                "`rightofway new controller`"
            )


def _home(module: ModuleType | None) -> Path:
    """The folder from which a module or package was imported."""
    file = Path(getattr(module, "__file__", None) or "nowhere")
    return (file.parent if file.name == "__init__.py" else file).parent


def _run(path: Path) -> Source:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ControllerError(f"{path}: cannot read the controller: {error.strerror}") from error
    module = ModuleType(f"<{path.name} {_sha256(bytes(path))[:12]}>")
    module.__file__ = str(path)

    def run() -> None:
        exec(compile(content, str(path), "exec", dont_inherit=True), vars(module))  # noqa: S102 - the user named the file to be run

    sys.modules[module.__name__] = module  # dataclasses and pickle look it up
    try:
        _imported(str(path), run, path)
    except ControllerError:
        del sys.modules[module.__name__]
        raise
    return Source(module, _sha256(content))


def _imported(title: str, load: Callable[[], Any], file: Path | None = None) -> Any:
    try:
        return load()
    except (Exception, SystemExit) as error:  # whatever code does when it is imported
        raise ControllerError(
            f"{title} cannot be imported: {_words(error, file)}{_hint(error, file)}"
        ) from error


def _words(error: BaseException, file: Path | None) -> str:
    """What happened, and in which line: of the file, if that can be said."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{type(error).__name__}: {error.msg} ({Path(error.filename).name}:{error.lineno})"
    places = [
        (Path(frame.filename), frame.lineno)
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename != __file__ and "importlib" not in frame.filename
    ]
    own = [place for place in places if place[0] == file] or places
    place = f" ({own[-1][0].name}:{own[-1][1]})" if own else ""
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
    target: object = module
    for part in attribute.split("."):
        target = getattr(target, part, None)
    if target is None:
        classes = [
            name
            for name, value in vars(module).items()
            if isinstance(value, type) and issubclass(value, Controller) and value is not Controller
        ]
        raise ControllerError(
            f"{title}: {module.__file__} has no {attribute}{nearest(attribute, classes)}"
        )
    return target


def origin_of_file(path: Path) -> str:
    """A file's name and SHA-256, as it was run or, where it has not been, as it is."""
    if ran := _sources.get(path.resolve()):
        return f"{path.name} sha256:{ran.sha256}"
    try:
        return f"{path.name} sha256:{_sha256(path.read_bytes())}"
    except OSError:
        return path.name


def origin_of_module(module: str) -> str:
    """The distribution and version that a module comes from; without one, its file's hash."""
    if names := _distributions().get(module.partition(".")[0]):
        return f"{names[0]} {version(names[0])}"
    path = getattr(sys.modules.get(module), "__file__", None) or _located(module)
    return origin_of_file(Path(path)) if path else "unknown"


@cache
def _distributions() -> Mapping[str, list[str]]:
    return packages_distributions()


def _located(module: str) -> str | None:
    """The file of a module that has not been imported, nor what contains it."""
    *packages, _ = accumulate(module.split("."), "{}.{}".format)
    folders: Sequence[str] | None = None
    for package in packages:
        spec = PathFinder.find_spec(package, folders)
        if spec is None or spec.submodule_search_locations is None:
            return None
        folders = list(spec.submodule_search_locations)
    spec = PathFinder.find_spec(module, folders)
    return spec.origin if spec else None


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()

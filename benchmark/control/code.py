"""Which code determines what, and its hash: of this package, of a plugin's, of what lies by a file.

Nothing is imported for it. What a plugin imports from other packages is not seen.
"""

import ast
import hashlib
import importlib.util
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from importlib.machinery import ModuleSpec
from pathlib import Path

DETERMINING = (
    "plumbing",
    "scenario",
    "control",
    "sumo",
    "world",
    "records/record.py",
    "study/episode.py",
    "study/actions.py",
    "study/identity.py",
    "learning/__init__.py",
    "learning/observation.py",
    "learning/weights.py",
)
"""Rooms and files of this package that an episode passes through: a change there may change its
figures, a change elsewhere cannot. A test compares this with what episodes import."""

NEIGHBOURS = frozenset({".py", ".safetensors", ".onnx", ".pt", ".pth", ".npz", ".npy"})
PROSE = frozenset({".md", ".rst"})
Named = tuple[str, Path]


@cache
def of_benchmark(*also: str) -> str:
    """SHA-256 of this package as far as it determines episodes.

    Args:
        also: rooms or files that count as well.
    """
    return digest(determining(Path(__file__).parents[1], also))


def determining(folder: Path, also: Iterable[str] = ()) -> Iterator[Named]:
    """The determining files of a copy of this package, with their names in it."""
    for room in sorted({*DETERMINING, *also}):
        place = folder / room
        paths = [place] if place.is_file() else sorted(place.rglob("*"))
        for path in paths:
            if path.is_file() and "__pycache__" not in path.parts:
                yield path.relative_to(folder).as_posix(), path


@cache
def of_package(package: str) -> str:
    """SHA-256 of a whole package's files as they are now; empty if there is none.

    Args:
        package: a name without dots, of a module too.
    """
    spec = importlib.util.find_spec(package)
    return digest(_files(spec)) if spec else ""


@cache
def of_module(module: str) -> str:
    """SHA-256 of a module, of all that it imports from its own package, and of the data there.

    Where the code imports by a name that only a run knows, the whole package counts.
    """
    package = module.partition(".")[0]
    spec = importlib.util.find_spec(package)
    if spec is None or not spec.submodule_search_locations or not spec.origin:
        return of_package(package)
    folder = Path(spec.submodule_search_locations[0])
    modules = _imported(module, folder)
    if modules is None:
        return of_package(package)
    paths = {*modules, *(data for path in modules for data in _data(path.parent))}
    return digest((path.relative_to(folder).as_posix(), path) for path in sorted(paths))


@cache
def of_code_and_weights(package: str) -> str:
    """SHA-256 of a package's code and weights as they are now; empty if there is none."""
    spec = importlib.util.find_spec(package)
    return digest(
        (name, path)
        for name, path in (_files(spec) if spec else ())
        if path.suffix in NEIGHBOURS and not any(part.startswith(".") for part in name.split("/"))
    )


@cache
def beside(folder: Path) -> str:
    """SHA-256 of a folder's neighbours."""
    return digest((path.name, path) for path in neighbours(folder))


def neighbours(folder: Path) -> list[Path]:
    """Code and weights that lie in a folder itself, where a controller from there may use them."""
    return [
        path for path in sorted(folder.iterdir()) if path.suffix in NEIGHBOURS and path.is_file()
    ]


def imported_from_beside(file: Path) -> list[str]:
    """The modules and packages of a file's folder that code there may import, by name."""
    imported: set[str] = set()
    with suppress(OSError):  # whoever runs the file says so
        modules = [path for path in neighbours(file.parent) if path.suffix == ".py"]
        there = {path.stem for path in modules}
        there |= {path.parent.name for path in file.parent.glob("*/__init__.py")}
        for path in modules:
            names = _names_imported(path, path.stem)
            imported |= there if names is None else {name.partition(".")[0] for name in names}
        imported &= there
    return sorted(imported)


def digest(files: Iterable[Named]) -> str:
    """SHA-256 of files by their names; empty for none."""
    total, empty = hashlib.sha256(), True
    for name, path in files:
        content, empty = path.read_bytes(), False
        total.update(f"{name}\0{len(content)}\0".encode() + content)
    return "" if empty else total.hexdigest()


def _files(spec: ModuleSpec) -> Iterator[Named]:
    """A package's files by their names in it, sorted."""
    if spec.submodule_search_locations is None:  # one file
        if spec.has_location and spec.origin:
            yield Path(spec.origin).name, Path(spec.origin)
        return
    # a folder without __init__.py may hold anything
    pattern = "*" if spec.origin else "*.py"
    for folder in map(Path, spec.submodule_search_locations):
        for path in sorted(folder.rglob(pattern)):
            parts = path.relative_to(folder).parts
            if path.is_file() and "__pycache__" not in parts:
                yield "/".join(parts), path


def _imported(module: str, folder: Path) -> set[Path] | None:
    """The files of a module and of what it imports from its package; None where nobody can tell.

    Args:
        module: its full name.
        folder: of its package.
    """
    paths: set[Path] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        parts = name.split(".")
        for depth in range(1, len(parts) + 1):  # what contains a module runs before it
            path = _path(".".join(parts[:depth]), folder)
            if path is None or path in paths:
                continue
            paths.add(path)
            names = _names_imported(path, ".".join(parts[:depth]))
            if names is None:
                return None
            package = parts[0]
            waiting += [name for name in names if name.partition(".")[0] == package]
    return paths if _path(module, folder) else None


def _path(name: str, folder: Path) -> Path | None:
    """The file of a module in a package's folder; None where there is no such module."""
    place = folder.joinpath(*name.split(".")[1:])
    for path in (place / "__init__.py", place.with_suffix(".py")):
        if path.is_file():
            return path
    return None


def _names_imported(path: Path, module: str) -> list[str] | None:
    """What a file imports, attributes too; None where that is known only when it runs."""
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):
        return None
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    names: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, *filter(None, [base])])
            names += [base, *(f"{base}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Name) and node.id == "__import__":
            return None
    dynamic = any(name.partition(".")[0] in ("importlib", "runpy", "pkgutil") for name in names)
    return None if dynamic else names


def _data(folder: Path) -> Iterator[Path]:
    """Files of a package's folder that are neither code nor prose, down to the next package."""
    for path in sorted(folder.iterdir()):
        if path.is_dir():
            if path.name != "__pycache__" and not (path / "__init__.py").exists():
                yield from _data(path)
        elif path.suffix != ".py" and path.suffix not in PROSE:
            yield path

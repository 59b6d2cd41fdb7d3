"""All that determines an episode's figures and is known before it runs, in one hash.

Two episodes of one identity give the same record but for its wall time, so the second need not be
run. Versions alone would not do: of an editable installation, code changes and its version stays.
What a controller's package imports from elsewhere is not seen; of a controller from a file, the
code and weights in the same folder are.
"""

import hashlib
import importlib.util
import json
import platform
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

from benchmark import __version__
from benchmark.control import plugins, reference
from benchmark.sumo import tools

APART = frozenset({"commands", "admission", "reports"})
"""Rooms of this package that no episode imports; a test holds that."""

DATA = frozenset({"scenarios"})
"""Folders without code; a checkout has it elsewhere than a wheel."""

NEIGHBOURS = frozenset({".py", ".safetensors", ".onnx", ".pt", ".pth", ".npz", ".npy"})


def of(
    *,
    scenario_hash: str,
    controller: str,
    controller_from: str,
    rate: float | None,
    seed: int,
    limits: Mapping[str, float] | None,
) -> str:
    """SHA-256 of what determines an episode.

    Args:
        scenario_hash: of its scenario.
        controller: its reference.
        controller_from: distribution and version, or a file's name and hash.
        rate: penetration rate.
        seed: of the demand and the controller.
        limits: of time and memory where the controller is isolated; None where it is not.
    """
    facts = {
        "scenario": scenario_hash,
        "controller": reference.label(controller),
        "controller_from": controller_from,
        "controller_code": _code_of(controller),
        "option_files": _option_files(controller),
        "rate": rate,
        "seed": seed,
        "limits": limits,
        "code": code("benchmark"),
        "versions": _versions(),
    }
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


@cache
def code(package: str) -> str:
    """SHA-256 of a package's files as they are now, weights among them; empty if there is none.

    Asked once per process.

    Args:
        package: a name without dots, of a module too; it is not imported.
    """
    return _digest(_files(package))


def _digest(files: Iterable[tuple[str, Path]]) -> str:
    """SHA-256 of files by their names; empty for none."""
    total, found = hashlib.sha256(), False
    for name, path in files:
        content, found = path.read_bytes(), True
        total.update(f"{name}\0{len(content)}\0".encode() + content)
    return total.hexdigest() if found else ""


def _files(package: str) -> Iterator[tuple[str, Path]]:
    """A package's files by their names in it, sorted."""
    spec = importlib.util.find_spec(package)
    if spec is None:
        return
    if spec.submodule_search_locations is None:  # one file
        if spec.has_location and spec.origin:
            yield Path(spec.origin).name, Path(spec.origin)
        return
    # a folder without __init__.py may hold anything
    pattern = "*" if spec.origin else "*.py"
    left_out = APART | DATA if package == "benchmark" else frozenset()
    for folder in map(Path, spec.submodule_search_locations):
        for path in sorted(folder.rglob(pattern)):
            parts = path.relative_to(folder).parts
            if path.is_file() and "__pycache__" not in parts and parts[0] not in left_out:
                yield "/".join(parts), path


def origin(controller: str) -> str:
    """Where a controller comes from, for the record: distribution and version, or a file, and hash.

    Of a package the hash is that of its code and weights, which may be edited while its version
    stays; Right of Way's own is told by its version.
    """
    found = plugins.provenance(controller)
    package = _package_of(controller)
    if package is None or found.startswith("rightofway "):
        return found
    hashed = code_and_weights(package)
    return f"{found.partition(' sha256:')[0]} sha256:{hashed}" if hashed else found


@cache
def code_and_weights(package: str) -> str:
    """SHA-256 of a package's code and weights as they are now; asked once per process."""
    return _digest(
        (name, path)
        for name, path in _files(package)
        if path.suffix in NEIGHBOURS and not any(one.startswith(".") for one in name.split("/"))
    )


def _code_of(controller: str) -> str | None:
    """SHA-256 of the package that a controller lies in; of a file's, of what lies beside it."""
    parts = reference.parse(controller)
    if parts.is_file:
        return beside(Path(parts.place).expanduser().parent)
    package = _package_of(controller)
    return code(package) if package else None


def _package_of(controller: str) -> str | None:
    """The top-level package or module of a controller that is no file."""
    parts = reference.parse(controller)
    if parts.is_file:
        return None
    entry = plugins.discovered().get(parts.place)
    module = parts.place if parts.attribute else entry.module if entry else None
    return module.partition(".")[0] if module else None


@cache
def beside(folder: Path) -> str:
    """SHA-256 of a folder's neighbours; asked once per process."""
    return _digest((path.name, path) for path in neighbours(folder))


def neighbours(folder: Path) -> list[Path]:
    """Code and weights that lie in a folder itself, where a controller from there may use them."""
    return [
        path for path in sorted(folder.iterdir()) if path.suffix in NEIGHBOURS and path.is_file()
    ]


def _option_files(controller: str) -> dict[str, str]:
    """SHA-256 of the files and folders that options name, such as weights."""
    named = {key: Path(value) for key, value in reference.parse(controller).options().items()}
    found = {}
    for key, path in named.items():
        with suppress(OSError):  # as a name it is too long, for one
            if path.is_file():
                found[key] = _digest([(path.name, path)])
            elif path.is_dir():
                found[key] = beside(path)
    return found


@cache
def _versions() -> dict[str, str]:
    return {
        "rightofway": __version__,
        "sumo": tools.sumo_version(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
    }

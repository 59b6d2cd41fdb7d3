"""All that determines an episode's figures and is known before it runs, in one hash.

Two episodes of one identity give the same record but for its wall time, so the second need not be
run. Versions alone would not do: of an editable installation, code changes and its version stays.
``benchmark.control.code`` says which code counts.
"""

import hashlib
import json
import platform
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

from benchmark import __version__
from benchmark.control import code, plugins, reference
from benchmark.sumo import tools


def identity_of(
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
        "code": code.of_benchmark(),
        "versions": _versions(),
    }
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def origin_of(controller: str) -> str:
    """Where a controller comes from, for the record: distribution and version, or a file, and hash.

    Of a package the hash is that of its code and weights, which may be edited while its version
    stays; Right of Way's own is told by its version.
    """
    source = plugins.provenance(controller)
    module = _module_of(controller)
    if module is None or source.startswith("rightofway "):
        return source
    hashed = code.of_code_and_weights(module.partition(".")[0])
    return f"{source.partition(' sha256:')[0]} sha256:{hashed}" if hashed else source


def _code_of(controller: str) -> str | None:
    """SHA-256 of a controller's module and what it imports; of a file's, of what lies beside it."""
    parts = reference.parse(controller)
    if parts.is_file:
        return code.beside(Path(parts.place).expanduser().parent)
    module = _module_of(controller)
    return code.of_module(module) if module else None


def _module_of(controller: str) -> str | None:
    """The module of a controller that is no file."""
    parts = reference.parse(controller)
    if parts.is_file:
        return None
    entry = plugins.discovered().get(parts.place)
    return parts.place if parts.attribute else entry.module if entry else None


def _option_files(controller: str) -> dict[str, str]:
    """SHA-256 of the files and folders that options name, such as weights."""
    hashes = {}
    for key, value in reference.parse(controller).options().items():
        path = Path(value)
        with suppress(OSError):  # as a name it is too long, for one
            if path.is_file():
                hashes[key] = code.digest([(path.name, path)])
            elif path.is_dir():
                hashes[key] = code.beside(path)
    return hashes


@cache
def _versions() -> dict[str, str]:
    return {
        "rightofway": __version__,
        "sumo": tools.sumo_version(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
    }

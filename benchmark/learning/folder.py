"""The folder of a training run: manifest, checkpoint, logs, weights."""

import hashlib
import json
import platform
import sys
import time
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from pydantic import BaseModel

import benchmark
from benchmark.control import code
from benchmark.learning.settings import Options
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.files import replaced, writing

PACKAGES = (
    "eclipse-sumo",
    "numpy",
    "torch",
    "stable-baselines3",
    "gymnasium",
    "safetensors",
    "optuna",
)


class Folder:
    """Where a run keeps what it leaves: manifest, checkpoint, logs, weights.

    Args:
        options: ``out`` is the folder.
        name: of what is trained.
        settings: all of the run's settings, of a class that the trainer's module defines.
        checkpoint: name of the file that a run resumes from.

    Raises:
        UsageError: there is a run already and ``resume`` was not asked for, or the other way
            round, or the run there has other settings.
    """

    def __init__(
        self, options: Options, name: str, settings: BaseModel, checkpoint: str = "checkpoint.pt"
    ) -> None:
        self.path = options.out
        self.checkpoint = self.path / checkpoint
        self._began = time.perf_counter()
        self._spent = 0.0
        plain = settings.model_dump(mode="json")
        self._manifest: dict[str, Any] = {
            "name": name,
            "settings": plain,
            "seed": options.seed,
            "command": ["rightofway", *sys.argv[1:]],
            "code": _code_hash(settings),
            "versions": _versions(),
        }
        manifest = self.path / "manifest.json"
        if options.resume:
            self._continue(manifest)
        elif self.checkpoint.exists() or _is_finished(manifest):
            raise UsageError(
                f"{self.path}: holds a training run; continue it with --resume, or give "
                "another --out"
            )
        with writing(self.path, "there", remedy="give another --out"):
            self.path.mkdir(parents=True, exist_ok=True)
            self.note()

    def _continue(self, manifest: Path) -> None:
        if not _is_finished(manifest) and not (manifest.is_file() and self.checkpoint.is_file()):
            raise UsageError(f"{self.path}: no training run to resume; leave out --resume")
        try:
            before = json.loads(manifest.read_text(encoding="utf-8"))
            self._spent = float(before["wall_time"])
        except (KeyError, TypeError, ValueError) as error:
            raise UsageError(f"{manifest}: damaged; start anew with another --out") from error
        if before.get("finished"):
            raise UsageError(f"{self.path}: the training run there is finished")
        for key in ("name", "settings", "seed", "code", "versions"):
            if before.get(key) != self._manifest[key]:
                raise UsageError(
                    f"{self.path}: was made with another {key}; a run resumes only unchanged: "
                    f"{_difference(before.get(key), self._manifest[key])}"
                )
        self._manifest["command"] = before.get("command")

    def note(self, **facts: object) -> None:
        """Write the manifest, with further facts."""
        self._manifest |= facts
        self._manifest["wall_time"] = round(self._spent + time.perf_counter() - self._began, 1)
        with replaced(self.path / "manifest.json") as file:
            file.write_text(json.dumps(self._manifest, indent=2) + "\n", encoding="utf-8")

    @property
    def manifest(self) -> Mapping[str, Any]:
        """What the manifest says."""
        return self._manifest


def _is_finished(manifest: Path) -> bool:
    """Whether a run's manifest says that it has ended; one that cannot be read may have."""
    if not manifest.is_file():
        return False
    try:
        return bool(json.loads(manifest.read_text(encoding="utf-8")).get("finished"))
    except (ValueError, AttributeError):
        return True


def _difference(before: object, now: object) -> str:
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted(before.keys() | now.keys()):
            if before.get(key) != now.get(key):
                return f"{key}: {_difference(before.get(key), now.get(key))}"
    return f"{before} there, {now} now"


def _code_hash(settings: BaseModel) -> str:
    """SHA-256 of the code that determines a training: the benchmark's, and the trainer's own.

    Args:
        settings: of a class that lies in the trainer's module.
    """
    ours = code.of_benchmark("learning")
    return hashlib.sha256(
        f"{ours} {code.of_module(type(settings).__module__)}".encode()
    ).hexdigest()


def _versions() -> dict[str, str]:
    versions = {"rightofway": benchmark.__version__, "python": platform.python_version()}
    for name in PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "missing"
    return versions

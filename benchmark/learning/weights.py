"""Learned weights in files: safetensors, which load without running code, checked when read."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmark.plumbing.errors import ControllerError

Arrays = Mapping[str, npt.NDArray[np.float32]]
Notes = Mapping[str, Any]
Shapes = Mapping[str, tuple[int, ...]]


@dataclass(frozen=True)
class Weights:
    """Named arrays, what was noted of them, and their SHA-256."""

    arrays: Arrays
    notes: Notes
    hash: str


def digest(arrays: Arrays) -> str:
    """SHA-256 of names, shapes and contents."""
    found = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name], dtype=np.float32)
        found.update(f"{name} {array.shape} ".encode())
        found.update(array.tobytes())
    return found.hexdigest()


def save(path: Path, arrays: Arrays, notes: Notes) -> None:
    """Write weights.

    Args:
        path: the file.
        arrays: by name.
        notes: how they came about; plain JSON values.
    """
    from safetensors.numpy import save_file

    plain = {name: np.ascontiguousarray(array, dtype=np.float32) for name, array in arrays.items()}
    metadata = {"notes": json.dumps(dict(notes), sort_keys=True), "digest": digest(plain)}
    save_file(plain, path, metadata=metadata)


def load(path: Path, shapes: Shapes | Callable[[Notes], Shapes], remedy: str) -> Weights:
    """Read weights and check that they are whole and fit.

    Args:
        path: the file.
        shapes: the shape that every array must have, or what tells it from the file's notes; a
            ``ValueError`` of it says that the notes make no sense.
        remedy: what to do where they do not, for messages.

    Raises:
        ControllerError: the file is missing, damaged, or of another network.
    """
    from safetensors import SafetensorError, safe_open

    try:
        path.open("rb").close()  # safetensors has no plain message for a missing file
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except OSError as error:
        raise ControllerError(
            f"{path}: cannot read the weights: {error.strerror or error}; {remedy}"
        ) from error
    except SafetensorError as error:
        raise ControllerError(
            f"{path}: not a whole safetensors file ({error}); {remedy}"
        ) from error
    if metadata.get("digest") != (found_digest := digest(arrays)):
        raise ControllerError(
            f"{path}: the weights do not match the SHA-256 noted in the file: it was changed or "
            f"written by something else; {remedy}"
        )
    try:
        notes = dict(json.loads(metadata["notes"]))
        expected = shapes(notes) if callable(shapes) else shapes
    except (KeyError, TypeError, ValueError) as error:
        raise ControllerError(f"{path}: the notes in the file are damaged; {remedy}") from error
    _compare(path, arrays, expected, remedy)
    return Weights(arrays, notes, found_digest)


def _compare(path: Path, arrays: Arrays, expected: Shapes, remedy: str) -> None:
    found = {name: array.shape for name, array in arrays.items()}
    for name in sorted(expected.keys() | found.keys()):
        if found.get(name) != expected.get(name):
            raise ControllerError(
                f"{path}: weights of another network: {name} is {found.get(name, 'missing')}, "
                f"expected {expected.get(name, 'none')}; {remedy}"
            )

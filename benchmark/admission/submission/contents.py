"""Which files a bundle may hold, and that none of them runs when it is read."""

import json
from pathlib import Path, PurePosixPath

WEIGHTS = (".safetensors", ".onnx", ".npy")
TEXTS = (".py", ".pyi", ".toml", ".json", ".txt", ".md", ".csv", ".yaml", ".yml", ".cfg", ".typed")
BARE = ("LICENSE", "LICENCE", "COPYING", "NOTICE", "README")
UNSAFE = (
    *(".pkl", ".pickle", ".pt", ".pth", ".ckpt", ".joblib", ".dill", ".h5", ".hdf5", ".keras"),
    *(".npz", ".mar", ".bin", ".pb"),
)
"""Formats of weights that can run code when they are loaded, or that hold others that can."""
REMEDY = "ship weights as safetensors or ONNX"
NOTED_ELSEWHERE = b"\x08location"  # how ONNX names a file with tensors beside it


def is_code(name: str) -> bool:
    """Whether a file belongs to a controller's code or weights."""
    path = PurePosixPath(name)
    return path.suffix.lower() in (*WEIGHTS, *TEXTS) or path.name in BARE


def is_unsafe(name: str) -> bool:
    """Whether a file is by its name of a kind that can run code when it is loaded."""
    return PurePosixPath(name).suffix.lower() in UNSAFE


def is_weights(name: str) -> bool:
    """Whether a file holds weights."""
    return PurePosixPath(name).suffix.lower() in WEIGHTS


def place_problem(name: str) -> str | None:
    """Why a file has no place in a bundle; None if it has."""
    folder, _, rest = name.partition("/")
    suffix = PurePosixPath(name).suffix.lower()
    if is_unsafe(name):
        return f"can run code when it is loaded; {REMEDY}"
    fits = {
        "manifest.toml": not rest,
        "records": suffix == ".jsonl",
        "actions": suffix == ".parquet",
        "weights": is_weights(name),
        "code": is_code(rest),
    }
    if not fits.get(folder, False):
        return (
            "has no place in a bundle, which holds manifest.toml, records/*.jsonl, "
            "actions/*.parquet, weights/ and code/"
        )
    return None


def content_problem(path: Path) -> str | None:
    """Why a file must not be loaded, by what it holds; None where nothing speaks against it."""
    suffix = path.suffix.lower()
    with path.open("rb") as file:
        head = file.read(2)
    if len(head) == 2 and head[0] == 0x80 and 2 <= head[1] <= 5:
        return f"is a pickle, which can run code when it is loaded; {REMEDY}"
    if suffix == ".npy":
        return _npy_problem(path)
    if suffix == ".safetensors":
        return _safetensors_problem(path)
    if suffix == ".onnx" and NOTED_ELSEWHERE in path.read_bytes():
        return "refers to tensors in another file; export it with everything inside"
    return None


def _npy_problem(path: Path) -> str | None:
    import numpy as np

    try:
        np.load(path, mmap_mode="r", allow_pickle=False)
    except ValueError as error:
        return f"holds pickled objects, or no array ({error}); {REMEDY}"
    except (EOFError, OSError) as error:
        return f"is damaged: {error}"
    return None


def _safetensors_problem(path: Path) -> str | None:
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="numpy") as file:
            json.dumps(list(file.keys()))
    except (SafetensorError, OSError) as error:
        return f"is not a whole safetensors file: {error}"
    return None

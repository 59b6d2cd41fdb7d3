"""Reads TOML files so that whatever is wrong with one ends in a message that names it."""

import tomllib
from pathlib import Path
from typing import Any

from benchmark.plumbing.errors import RightOfWayError


def read(path: Path, kind: type[RightOfWayError]) -> dict[str, Any]:
    """The tables of a file.

    Args:
        path: where it is.
        kind: the error to raise.

    Raises:
        RightOfWayError: of that kind; the file is missing, not UTF-8 or not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise kind(f"{path}: cannot read the file: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise kind(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8") from error
    except (RecursionError, ValueError) as error:  # too deep; bad syntax or a number too long
        raise kind(f"{path}: not valid TOML: {error}") from error

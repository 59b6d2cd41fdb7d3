"""Reads TOML files so that whatever is wrong with one ends in a message that names it."""

import re
import tomllib
from pathlib import Path
from typing import Any

from benchmark.plumbing.depth import DEEPEST, check_depth
from benchmark.plumbing.errors import RightOfWayError

LARGEST = 4 * 2**20  # bytes
PART = rb"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
LONG_KEY = re.compile(rb"(?<![A-Za-z0-9_-])(?:%b){%d}" % (PART, DEEPEST))
"""A dotted key over which tomllib would ponder for minutes."""


def read(path: Path, kind: type[RightOfWayError]) -> dict[str, Any]:
    """The tables of a file.

    Args:
        path: where it is.
        kind: the error to raise.

    Raises:
        RightOfWayError: of that kind; the file is missing, not UTF-8 or not TOML.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise kind(f"{path}: has more than {LARGEST} bytes, which no such file needs")
        if LONG_KEY.search(content):
            raise ValueError(f"a key of more than {DEEPEST} parts")
        document = tomllib.loads(content.decode("utf-8-sig").replace("\r\n", "\n"))
        check_depth(document)
    except RightOfWayError:
        raise
    except OSError as error:
        raise kind(f"{path}: cannot read the file: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise kind(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8") from error
    except (RecursionError, ValueError) as error:  # too deep; bad syntax or a number too long
        raise kind(f"{path}: not valid TOML: {error}") from error
    return document

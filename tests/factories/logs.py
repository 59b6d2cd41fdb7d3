"""Action logs that somebody has written anew."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import polars

from benchmark.study import action_log
from benchmark.study.action_log import KEY


def rewritten(path: Path, head: Mapping[str, Any], rows: polars.DataFrame | None = None) -> None:
    """A log whose metadata, and perhaps rows, are others."""
    frame = polars.read_parquet(path) if rows is None else rows
    frame.write_parquet(path, metadata={KEY: json.dumps(head)})


def head_of(path: Path) -> dict[str, Any]:
    head: dict[str, Any] = json.loads(polars.read_parquet_metadata(path)[KEY])
    return head


def sealed(path: Path, rows: polars.DataFrame | None = None, **changes: Any) -> None:
    """As ``rewritten``, with a SHA-256 that fits: the work of a forger, not of chance."""
    head = {key: one for key, one in (head_of(path) | changes).items() if key != "sha256"}
    frame = polars.read_parquet(path) if rows is None else rows
    rewritten(path, head | {"sha256": action_log._digest(head, frame)}, frame)

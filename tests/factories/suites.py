"""A small suite to change."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

SMALL: Mapping[str, Any] = {
    "scenarios": ["smoke/crossing"],
    "controllers": ["traffic-light", "virtual-signal?green=5"],
    "rates": [0.4, 0.6],
    "seeds": 2,
}


def written(path: Path, **changes: object) -> Path:
    """A small suite with changes; None leaves a key out."""
    document = {key: value for key, value in {**SMALL, **changes}.items() if value is not None}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(tomli_w.dumps(document))
    return path

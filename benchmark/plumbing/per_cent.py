"""Shares as tables write them."""

import re
from typing import Any

PER_CENT = re.compile(r"\s*([0-9]+(?:\.[0-9]+)?)\s*%\s*")


def share(given: Any) -> Any:
    """A text in per cent, as in ``40%`` or ``40 %``, as a number; all else as it is."""
    per_cent = PER_CENT.fullmatch(given) if isinstance(given, str) else None
    return float(per_cent[1]) / 100 if per_cent else given

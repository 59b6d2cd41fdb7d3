"""How deeply data from elsewhere is nested; what recurses over it must not be led too far."""

from typing import Any

DEEPEST = 64


def check_depth(value: Any) -> None:
    """Make sure that lists and tables lie within each other at most ``DEEPEST`` times.

    Raises:
        ValueError: they lie deeper.
    """
    level: list[Any] = [value]
    for _ in range(DEEPEST):
        inner: list[Any] = []
        for item in level:
            if isinstance(item, dict):
                inner += [part for part in item.values() if isinstance(part, dict | list)]
            elif isinstance(item, list):
                inner += [part for part in item if isinstance(part, dict | list)]
        if not inner:
            return
        level = inner
    raise ValueError(f"lists and tables within each other more than {DEEPEST} deep")

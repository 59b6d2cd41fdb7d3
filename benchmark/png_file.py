"""Writes figures as PNG, the same figure as the same bytes."""

from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.errors import UsageError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESOLUTION = 180  # dots per inch


def save(figure: "Figure", target: Path) -> None:
    """Write a figure.

    Raises:
        UsageError: the file cannot be written.
    """
    try:
        figure.savefig(target, format="png", dpi=RESOLUTION, metadata={"Software": None})
    except OSError as error:
        raise UsageError(
            f"{target}: cannot write the figure: {error.strerror}; choose another folder with --out"
        ) from error

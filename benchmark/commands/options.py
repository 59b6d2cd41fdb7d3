"""Arguments and options that several commands share."""

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from benchmark.plumbing.files import results_folder
from benchmark.plumbing.per_cent import share

LARGEST_SEED = 2**63 - 1  # from 2**31 on SUMO gets a hash of it


def rate_of(given: str | float) -> float:
    """A penetration rate as the user writes it: ``0.4``, ``40%`` or ``40 %``.

    Raises:
        typer.BadParameter: it is none.
    """
    try:
        rate = float(share(given))
    except ValueError:
        rate = math.nan
    if not 0 <= rate <= 1:
        raise typer.BadParameter(f"{given}: expected a share from 0 to 1, as in 0.4 or 40%")
    return rate


def rate_option(*names: str, words: str) -> Any:
    """An option that takes penetration rates; ``words`` are its help."""
    return typer.Option(*names, parser=rate_of, metavar="RATE", help=words)


OneScenario = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A file or a shipped name, such as 334.")
]
Records = Annotated[
    Path,
    typer.Option(
        "--records", help="Results folder, or its records folder.", callback=results_folder
    ),
]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes side by side; default: one per core.")
]

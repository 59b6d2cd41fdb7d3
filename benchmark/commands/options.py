"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from benchmark.plumbing.files import results_folder

LARGEST_SEED = 2**63 - 1  # from 2**31 on SUMO gets a hash of it


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

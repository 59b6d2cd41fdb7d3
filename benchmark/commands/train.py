"""The command ``rightofway train``."""

import os
from pathlib import Path
from typing import Annotated

import typer

from benchmark.commands.options import rate_option


def train(
    name: Annotated[str, typer.Argument(metavar="NAME", help="What to train, such as wang.")],
    scenario: Annotated[
        list[str] | None, typer.Option("--scenario", help="Repeatable; default: the settings'.")
    ] = None,
    rate: Annotated[
        list[float] | None,
        rate_option("--rate", "--rates", words="Repeatable; default: the settings'."),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Decisions of vehicles to learn from; the last round is played to its end.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of weights, draws and traffic.")] = 1,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes that play; default: all cores but one.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run; default: out/train/NAME-SEED.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on where a run stopped.")] = False,
    change: Annotated[
        list[str] | None,
        typer.Option("--set", help="Repeatable; a setting, as in reward.penalty=0.3."),
    ] = None,
) -> None:
    """Train a learned controller; needs the extra rightofway[train]."""
    from benchmark.learning import trainers
    from benchmark.learning.settings import Options

    trainer = trainers.load(name)
    trainer(
        Options(
            out=out or Path("out/train") / f"{name}-{seed}",
            scenarios=scenario or None,
            rates=rate or None,
            steps=steps,
            seed=seed,
            workers=workers or max(1, (os.cpu_count() or 1) - 1),
            resume=resume,
            changes=change or (),
            notify=lambda message: typer.echo(message, err=True),
        )
    )

"""The command ``rightofway run``."""

from pathlib import Path
from typing import Annotated

import typer

from benchmark.commands import console, failures, log_file, where
from benchmark.commands.choice import choose
from benchmark.commands.leaderboard import print_leaderboard
from benchmark.commands.options import LARGEST_SEED, Workers, rate_option
from benchmark.commands.progress import progress_bar
from benchmark.control.isolation.limits import Limits
from benchmark.plumbing.errors import UsageError

GO_ON = "the same command goes on from there"

Scenarios = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[SCENARIO]...",
        help="Files, folders or shipped names, or one suite; default: the paper's four.",
    ),
]

LONGEST_LIMIT = 604_800.0  # s, a week
LARGEST_MEMORY = 2**24  # MB


def run(
    scenario: Scenarios = None,
    controller: Annotated[
        list[str] | None,
        typer.Option(
            "--controller",
            help="Repeatable; NAME, file.py:Class or package.module:Class, options as in "
            "NAME?option=value&option=value; default: the suite's or all.",
        ),
    ] = None,
    rate: Annotated[
        list[float] | None,
        rate_option("--rate", words="Repeatable; default: the suite's or scenario's."),
    ] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Use the seeds 1 to N.")] = None,
    seed: Annotated[
        list[int] | None, typer.Option(min=0, max=LARGEST_SEED, help="Repeatable; this seed.")
    ] = None,
    workers: Workers = None,
    out: Annotated[Path, typer.Option(help="Folder for records and leaderboard.")] = Path("out"),
    log_actions: Annotated[
        bool,
        typer.Option("--log-actions", help="Also write commands, to OUT/actions, for `replay`."),
    ] = False,
    record_trajectories: Annotated[
        bool,
        typer.Option(
            "--record-trajectories",
            help="Also write a page that plays each episode, to OUT/replays (docs/replay.md).",
        ),
    ] = False,
    isolate: Annotated[
        bool | None,
        typer.Option(
            "--isolate/--no-isolate",
            help="Controllers in processes of their own; default: those that are not installed.",
        ),
    ] = None,
    step_limit: Annotated[
        float,
        typer.Option(min=0.001, max=LONGEST_LIMIT, help="Isolated: wall time for an answer [s]."),
    ] = Limits.step,
    start_limit: Annotated[
        float,
        typer.Option(
            min=0.001, max=LONGEST_LIMIT, help="Isolated: wall time to import, and to reset [s]."
        ),
    ] = Limits.start,
    answers_limit: Annotated[
        float,
        typer.Option(
            min=0.001, max=LONGEST_LIMIT, help="Isolated: wall time for an episode's answers [s]."
        ),
    ] = Limits.episode,
    memory_limit: Annotated[
        int, typer.Option(min=256, max=LARGEST_MEMORY, help="Isolated: address space [MB].")
    ] = Limits.memory,
    time_limit: Annotated[
        float,
        typer.Option(min=0.1, max=LONGEST_LIMIT, help="Wall time for one try at an episode [s]."),
    ] = 600.0,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Run on the Dask cluster of this scheduler, as in tcp://host:8786."),
    ] = None,
    scheduler_file: Annotated[
        Path | None, typer.Option(help="The same, its address in the file that Dask writes.")
    ] = None,
    cluster: Annotated[
        where.Started | None, typer.Option(help="Start a Dask cluster on this machine.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Also run what the folder holds already.")
    ] = False,
    log: Annotated[
        Path | None, typer.Option("--log-file", help="Append lines of JSON about the run to it.")
    ] = None,
) -> None:
    """Run episodes, append their records and print the leaderboard.

    What the folder holds already is not run again.
    """
    from benchmark.study.study import run_study

    if seeds and seed:
        raise UsageError("--seeds and --seed exclude each other; give one of them")
    episodes = choose(
        scenario,
        controller,
        rate,
        seed or range(1, (seeds or 0) + 1),
        isolate,
        Limits(step_limit, start_limit, answers_limit, memory_limit),
    )
    beside = where.beside(out, actions=log_actions, pages=record_trajectories)
    executor = where.executor(
        workers,
        time_limit,
        beside,
        scheduler=scheduler,
        scheduler_file=scheduler_file,
        cluster=cluster,
    )
    with log_file.following(log):
        study = run_study(
            episodes,
            out,
            force=force,
            executor=executor,
            keepsakes=beside.keepsakes,
            notice=console.notice,
            progress=progress_bar,
        )
    if not study.interrupted:
        print_leaderboard(study.rows)
        console.say(f"all figures: {out / 'LEADERBOARD.md'}")
    failures.report(study.results, out, time_limit)
    if study.interrupted:
        console.notice(
            f"stopped; {len(study.results)} of {len(episodes)} records are in {out / 'records'}; "
            + ("without --force the same command runs only what has no record" if force else GO_ON)
        )
        raise KeyboardInterrupt
    if any(outcome.is_failure for _, outcome in study.results):
        raise typer.Exit(1)

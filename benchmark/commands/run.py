"""The command ``rightofway run``."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console, failures, log_file, study
from benchmark.commands.records import print_leaderboard, write_leaderboard
from benchmark.errors import UsageError
from benchmark.isolation.limits import Limits

if TYPE_CHECKING:
    from benchmark.episode import Episode

LARGEST_SEED = 2**31 - 1  # of SUMO
PAPER = "colorado-springs"

Scenarios = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[SCENARIO]...",
        help="Files, folders or shipped names, or one suite; default: the paper's four.",
    ),
]


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
        typer.Option(
            "--rate", min=0, max=1, help="Repeatable; default: the suite's or scenario's."
        ),
    ] = None,
    seeds: Annotated[int | None, typer.Option(min=1, help="Use the seeds 1 to N.")] = None,
    seed: Annotated[
        list[int] | None, typer.Option(min=0, max=LARGEST_SEED, help="Repeatable; this seed.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes side by side; default: one per core.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for records and leaderboard.")] = Path("out"),
    isolate: Annotated[
        bool | None,
        typer.Option(
            "--isolate/--no-isolate",
            help="Controllers in processes of their own; default: those that are not installed.",
        ),
    ] = None,
    step_limit: Annotated[
        float, typer.Option(min=0.001, help="Isolated: wall time for an answer [s].")
    ] = Limits.step,
    start_limit: Annotated[
        float, typer.Option(min=0.001, help="Isolated: wall time to import, and to reset [s].")
    ] = Limits.start,
    answers_limit: Annotated[
        float, typer.Option(min=0.001, help="Isolated: wall time for an episode's answers [s].")
    ] = Limits.episode,
    memory_limit: Annotated[
        int, typer.Option(min=256, help="Isolated: address space [MB].")
    ] = Limits.memory,
    time_limit: Annotated[
        float, typer.Option(min=0.1, help="Wall time for one try at an episode [s].")
    ] = 600.0,
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
    from benchmark import leaderboard
    from benchmark.local import LocalPool, cores
    from benchmark.store import Store

    if seeds and seed:
        raise UsageError("--seeds and --seed exclude each other; give one of them")
    store = Store(out, notice=console.notice)
    chosen = _chosen(
        scenario or [PAPER],
        controller or [],
        rate or [],
        seed or range(1, (seeds or 0) + 1),
        isolate,
        Limits(step_limit, start_limit, answers_limit, memory_limit),
    )
    _say_what_isolation_lacks(chosen)
    executor = LocalPool(workers or cores(), time_limit)
    with log_file.following(log), store.writing():
        done = study.run(chosen, executor, store, force=force)
        if not done.interrupted:
            rows = leaderboard.rows(store.read())
            write_leaderboard(rows, out)
            print_leaderboard(rows, out)
    failures.report(done.results, out, time_limit)
    if done.interrupted:
        console.notice(done.words(len(chosen), store.records_folder, force=force))
        raise KeyboardInterrupt
    if any(record.is_failure for _, record in done.results):
        raise typer.Exit(1)


def _chosen(
    references: Sequence[str],
    controllers: Sequence[str],
    rates: Sequence[float],
    seeds: Sequence[int],
    isolate: bool | None,
    limits: Limits,
) -> "list[Episode]":
    """The episodes that were asked for; what was left open is the suite's, or the default."""
    from benchmark import catalogue, suite, suite_file

    declared = suite_file.find(references)
    if declared is None:
        scenarios = catalogue.find(references, also=suite_file.shipped())
        controllers = controllers or _usable_controllers(isolate, limits)
    else:
        scenarios = declared.load_scenarios()
        controllers = controllers or declared.checked_controllers(isolate, limits)
        rates = rates or declared.rates or ()
        seeds = seeds or range(1, (declared.seeds or 0) + 1)
    once = dict.fromkeys
    return suite.episodes(
        scenarios,
        list(once(controllers)),
        list(once(rates)) or None,
        list(once(seeds)) or None,
        isolate=isolate,
        limits=limits,
    )


def _say_what_isolation_lacks(chosen: "Sequence[Episode]") -> None:
    """Name what an isolated controller can do on this system all the same."""
    from benchmark.isolation import sandbox
    from benchmark.isolation.remote import isolated

    if any(isolated(one.controller, one.isolate) for one in chosen):
        for deed in sandbox.missing():
            console.notice(f"on this system isolated controllers can {deed}")


def _usable_controllers(isolate: bool | None, limits: Limits) -> list[str]:
    """All installed controllers but those that cannot be loaded, which are named."""
    from benchmark import plugins
    from benchmark.errors import ControllerError
    from benchmark.isolation.remote import look

    usable = []
    for name in plugins.discovered():
        try:
            look(name, isolate, limits)
        except ControllerError as error:
            console.notice(f"{error}; left out")
        else:
            usable.append(name)
    return usable

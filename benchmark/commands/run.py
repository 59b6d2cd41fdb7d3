"""The command ``rightofway run``."""

import os
from collections.abc import Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console, progress
from benchmark.commands.records import print_leaderboard, write_leaderboard
from benchmark.errors import UsageError
from benchmark.isolation.limits import DEFAULT, Limits

if TYPE_CHECKING:
    from benchmark.episode import Episode
    from benchmark.record import Record
    from benchmark.store import Store

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
    log_actions: Annotated[
        bool,
        typer.Option("--log-actions", help="Also write commands, to OUT/actions, for `replay`."),
    ] = False,
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
) -> None:
    """Run episodes, append their records and print the leaderboard."""
    from benchmark import action_log, leaderboard, suite
    from benchmark.store import Store

    if seeds and seed:
        raise UsageError("--seeds and --seed exclude each other; give one of them")
    store = Store(out, notice=console.notice)
    chosen = choose(
        scenario or [PAPER],
        controller or [],
        rate or [],
        seed or range(1, (seeds or 0) + 1),
        isolate,
        Limits(step_limit, start_limit, answers_limit, memory_limit),
    )
    _say_what_isolation_lacks(chosen)
    store.prepare()
    actions = action_log.folder_in(out) if log_actions else None
    if actions is not None:
        action_log.prepare(actions)
    suite.prepare(chosen)
    records = run_with_progress(chosen, workers or os.cpu_count() or 1, store, actions)
    rows = leaderboard.rows(store.read())
    write_leaderboard(rows, out)
    print_leaderboard(rows, out)
    report_failures(records)
    if any(record.status not in ("ok", "skipped") for record in records):
        raise typer.Exit(1)


def choose(
    references: Sequence[str],
    controllers: Sequence[str],
    rates: Sequence[float],
    seeds: Sequence[int],
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
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


def run_with_progress(
    chosen: "Sequence[Episode]", workers: int, store: "Store", actions: Path | None = None
) -> "list[Record]":
    """Run episodes with a bar on standard error and append their records.

    Args:
        chosen: what to run.
        workers: processes side by side.
        store: where records go.
        actions: the folder for action logs, if any are wanted.
    """
    from benchmark import replay

    work = None if actions is None else partial(replay.run_logged, folder=actions)
    records = []
    try:
        with closing(progress.run_all(chosen, workers, work)) as running:
            for record in running:
                store.append(record)
                records.append(record)
    except KeyboardInterrupt:
        console.notice(
            f"stopped; {len(records)} of {len(chosen)} records are in {store.records_folder}; "
            "a new run starts from the beginning"
        )
        raise
    return records


def report_failures(records: "Sequence[Record]") -> None:
    """Name each kind of failure once, with an episode that shows it."""
    seen: dict[tuple[str, str, str], list[Record]] = {}
    for record in records:
        if record.status != "ok":
            key = (record.controller, record.status, record.reason or "")
            seen.setdefault(key, []).append(record)
    for (controller, status, reason), members in seen.items():
        one = members[0]
        console.notice(
            f"{controller}: {len(members)} {status}, such as {one.scenario} "
            f"rate {one.rate} seed {one.seed}: {reason}"
        )
    refusals: dict[str, int] = {}
    for record in records:
        for junction in record.junctions.values():
            for reason in junction.refusals:
                kind = reason.rpartition(" (")[0]
                refusals[kind] = refusals.get(kind, 0) + 1
    for kind, episodes in refusals.items():
        console.notice(f"{kind} (in {episodes} of {len(records)} episodes)")

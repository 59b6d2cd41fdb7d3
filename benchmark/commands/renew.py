"""The command ``rightofway renew``."""

import random
from pathlib import Path
from typing import Annotated

import typer

from benchmark.commands import console
from benchmark.commands.options import Records

SHOWN = 10  # cells that differ


def renew(
    records: Records = Path("out"),
    seeds: Annotated[
        int, typer.Option(min=1, help="How many episodes of every cell are run again.")
    ] = 1,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes side by side; default: one per core.")
    ] = None,
    scenario: Annotated[
        list[str] | None, typer.Option(help="Repeatable; files of scenarios that do not ship.")
    ] = None,
) -> None:
    """Let records of earlier code count for today's, where a sample of them comes out equal.

    Runs episodes of every cell (scenario, controller, rate) again, drawn at random. A cell whose
    figures are equal, to six digits, gets the identity of today's code, so that `run` does not run
    it anew; cells that have it are left out. Exit code 1: some cell differs; its records stay as
    they are.
    """
    from benchmark.commands.progress import progress_bar
    from benchmark.plumbing.processes import cores
    from benchmark.records.store import Store
    from benchmark.scenario import catalogue
    from benchmark.study.episodes import build_ahead
    from benchmark.study.pool import LocalPool
    from benchmark.study.renewal import renew as renewed
    from benchmark.study.renewal import sample_of
    from benchmark.study.repeats import repeats_of

    store = Store(records, notice=console.notice)
    with store.writing():
        held = store.read()
        repeats = repeats_of(held, catalogue.find_scenarios(scenario or []))
        for (name, _), reason in repeats.incomparable.items():
            console.notice(f"{name}: {reason}; its records stay as they are")
        newest = {record.episode: record.identity for record in held}
        stale = [each for each in repeats.episodes if newest[each.key] != each.identity]
        sample = sample_of(stale, seeds, random.SystemRandom())
        build_ahead(sample)
        with progress_bar(sample) as advance:
            pool = LocalPool(workers or cores())
            renewal = renewed(stale, sample, held, pool, advance)
        store.rewrite(renewal.applied)
    for (name, _, controller, rate), changes in list(renewal.differing.items())[:SHOWN]:
        at = "" if rate is None else f" at {100 * rate:g} %"
        console.notice(f"{name}, {controller}{at}: {changes[0]}")
    console.say(
        f"{renewal.sampled} episodes run again: {len(renewal.differing)} cells differ; "
        f"{len(renewal.identities)} records have the identity of this code"
    )
    if renewal.differing:
        raise typer.Exit(1)

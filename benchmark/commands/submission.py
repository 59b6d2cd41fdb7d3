"""The commands ``rightofway submit`` and ``rightofway verify``."""

import tempfile
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console, where
from benchmark.commands.choice import choose, suite_named
from benchmark.commands.options import LARGEST_SEED, Workers, rate_option
from benchmark.commands.progress import progress_bar
from benchmark.plumbing import files
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.admission.submission.verifying import Verification

COLOURS = {"ok": "green", "noted": "yellow", "failed": "red", "not checked": "yellow"}
UNDECIDED = 3  # exit code


def submit(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="The controller; NAME or NAME?option=value.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="The bundle, a zip archive.")],
    scenario: Annotated[
        list[str] | None,
        typer.Option("--scenario", help="Repeatable; as for `run`; default: the paper's four."),
    ] = None,
    suite: Annotated[
        str | None, typer.Option("--suite", help="A suite, in place of scenarios.")
    ] = None,
    rate: Annotated[
        list[float] | None,
        rate_option("--rate", words="Repeatable."),
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=1000, help="Use the seeds 1 to N.")
    ] = None,
    author: Annotated[
        list[str] | None, typer.Option("--author", help="Repeatable; default: the package's.")
    ] = None,
    description: Annotated[
        str | None, typer.Option(help="One line; default: the docstring's first.")
    ] = None,
    paper: Annotated[str | None, typer.Option(help="Its title, DOI or address.")] = None,
    licence: Annotated[
        str | None, typer.Option("--licence", "--license", help="Default: the package's.")
    ] = None,
    code: Annotated[
        bool, typer.Option(help="Include the code, so that it can be run on fresh seeds.")
    ] = True,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing file.")] = False,
    workers: Workers = None,
) -> None:
    """Run a controller and bundle records, action logs and code for others to verify."""
    from benchmark.admission.submission import making
    from benchmark.plumbing.processes import cores
    from benchmark.records.store import Store
    from benchmark.study import action_log, rescoring
    from benchmark.study.pool import LocalPool
    from benchmark.study.study import run_missing

    if scenario and suite:
        raise UsageError("--scenario and --suite exclude each other; give one of them")
    _check_target(output, force=force)
    attribution = making.Attribution(author or (), description, paper, licence)
    submission = making.gather(name, attribution, with_code=code)
    if submission.includes_code and (left := submission.code.left_out):
        console.notice(f"{len(left)} files of its package are left out, such as {left[0]}")
    if suite:
        suite_named(suite)  # says what is wrong with it
    isolate = None if making.ships(submission) else True
    seeded = range(1, (seeds or 0) + 1)
    episodes = choose([suite] if suite else scenario, [name], rate, seeded, isolate)
    making.check(submission, {episode.scenario.name for episode in episodes})
    with tempfile.TemporaryDirectory(prefix="rightofway-submission-") as place:
        results = Path(place)
        store = Store(results, notice=console.notice)
        beside = where.beside(results, actions=True, pages=False)
        how = making.lay_out(submission, results)
        logs = action_log.log_folder(results)
        work = partial(rescoring.run_logged, folder=logs, run=how) if how else beside.work
        with store.writing():
            study = run_missing(
                episodes,
                LocalPool(workers or cores(), work=work),
                store,
                keepsakes=beside.keepsakes,
                notice=console.notice,
                progress=progress_bar,
            )
        if study.interrupted:
            console.notice(f"stopped; {output} is not written")
            raise KeyboardInterrupt
        records = store.read()
        making.write(output, submission, results, records)
    if bad := [record for record in records if record.status != "ok"]:
        such = f"{bad[0].scenario}: {bad[0].status}: {bad[0].reason}"
        console.notice(f"{len(bad)} of {len(records)} episodes did not end well, such as {such}")
    console.say(f"{output}: {len(records)} episodes, {output.stat().st_size} bytes")


def _check_target(target: Path, *, force: bool) -> None:
    """Refuse a file that cannot be written before anything is run."""
    if target.is_dir():
        raise UsageError(f"{target}: is a folder; give a file, such as bundle.zip")
    if target.exists() and not force:
        raise UsageError(f"{target}: exists; --force replaces it")
    with files.writing(target, "the bundle", remedy=""):
        files.probe(target.parent)


def verify(
    bundle: Annotated[Path, typer.Argument(help="What `rightofway submit` wrote.")],
    fresh: Annotated[
        int,
        typer.Option(
            min=0, max=10_000, help="Seeds to draw, and as many again where it does worse there."
        ),
    ] = 60,
    fresh_seed: Annotated[
        list[int] | None,
        typer.Option(
            "--fresh-seed", min=0, max=LARGEST_SEED, help="Repeatable; in the first draw."
        ),
    ] = None,
    every: Annotated[
        bool, typer.Option("--all", help="Make every record again, not a sample of them.")
    ] = False,
    run_code: Annotated[
        bool, typer.Option(help="Run code that the bundle brings, in a process of its own.")
    ] = True,
    out: Annotated[
        Path | None, typer.Option(help="Append an accepted bundle's records to this folder.")
    ] = None,
    workers: Workers = None,
) -> None:
    """Check a bundle: hashes, weights, records, replay, and the controller on fresh seeds.

    Exit code 0: accepted; 1: not accepted, and why; 2: it is no bundle; 3: not accepted, as checks
    were left out or cannot tell.
    """
    from benchmark.admission.submission import verifying
    from benchmark.plumbing.processes import cores
    from benchmark.records.store import Store

    store = Store(out, notice=console.notice) if out else None
    wishes = verifying.Wishes(fresh, fresh_seed or (), every, run_code, workers or cores())
    with store.writing() if store else nullcontext():
        verification = verifying.verify(bundle, wishes)
        _show(bundle, verification)
        if verification.objections:
            raise typer.Exit(1)
        if not verification.is_accepted:
            raise typer.Exit(UNDECIDED)
        if store:
            scenarios = {record.scenario for record in verification.records}
            there = {record.line() for record in store.records_of(scenarios)}
            new = [record for record in verification.records if record.line() not in there]
            for record in new:
                store.append(record)
            console.say(f"{len(new)} records appended to {store.records_folder}")


def _show(bundle: Path, verification: "Verification") -> None:
    from rich.table import Table

    manifest = verification.manifest
    whose = f"{manifest.name} ({manifest.code.source}) by {', '.join(manifest.authors)}"
    lines = [f"{bundle}: {whose}, {manifest.licence}", manifest.description]
    if manifest.paper:
        lines.append(f"paper: {manifest.paper}")
    for line in lines:
        console.stdout().print(console.literal(" ".join(line.split())), soft_wrap=True)
    table = Table("check", "verdict", "what was found", box=None)
    for check in verification.checks:
        table.add_row(
            check.name,
            f"[{COLOURS[check.verdict]}]{check.verdict}[/]",
            console.literal(" ".join(check.words.split())),
        )
    console.stdout().print(table)
    names = ", ".join(check.name for check in verification.objections)
    left = ", ".join(check.name for check in verification.open)
    if names:
        console.say(f"not accepted: {names}")
    else:
        console.say(
            f"not accepted: nothing speaks against it, not checked: {left}" if left else "accepted"
        )

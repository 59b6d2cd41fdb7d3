"""The commands ``rightofway submit`` and ``rightofway verify``."""

import tempfile
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console, suites
from benchmark.commands.choice import LARGEST_SEED, PAPER, choose
from benchmark.plumbing import files
from benchmark.plumbing.errors import UsageError
from benchmark.study import study

if TYPE_CHECKING:
    from benchmark.admission.submission.verifying import Verification

COLOURS = {"ok": "green", "noted": "yellow", "failed": "red", "not checked": "yellow"}

Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes side by side; default: one per core.")
]


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
        list[float] | None, typer.Option("--rate", min=0, max=1, help="Repeatable.")
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

    if scenario and suite:
        raise UsageError("--scenario and --suite exclude each other; give one of them")
    _check_target(output, force=force)
    words = making.Words(author or (), description, paper, licence)
    subject = making.subject(name, words, with_code=code)
    if subject.includes_code and (left := subject.code.left_out):
        console.notice(f"{len(left)} files of its package are left out, such as {left[0]}")
    if suite:
        suites.find(suite)  # says what is wrong with it
    references = [suite] if suite else scenario or [PAPER]
    chosen = choose(references, [name], rate or [], range(1, (seeds or 0) + 1))
    with tempfile.TemporaryDirectory(prefix="rightofway-submission-") as place:
        results = Path(place)
        store = Store(results, notice=console.notice)
        actions = action_log.folder_in(results)
        work = partial(rescoring.run_logged, folder=actions)
        executor = LocalPool(workers or cores(), work=work)
        with store.writing():
            done = study.run(chosen, executor, store, actions=actions)
        if done.interrupted:
            console.notice(f"stopped; {output} is not written")
            raise KeyboardInterrupt
        records = store.read()
        making.write(output, subject, results, records)
    if bad := [one for one in records if one.status != "ok"]:
        such = f"{bad[0].scenario}: {bad[0].status}: {bad[0].reason}"
        console.notice(f"{len(bad)} of {len(records)} episodes did not end well, such as {such}")
    typer.echo(f"{output}: {len(records)} episodes, {output.stat().st_size} bytes")


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
            min=0, max=100, help="Seeds to draw, and as many again where it does worse there."
        ),
    ] = 10,
    fresh_seed: Annotated[
        list[int] | None,
        typer.Option(
            "--fresh-seed", min=0, max=LARGEST_SEED, help="Repeatable; in the first draw."
        ),
    ] = None,
    run_code: Annotated[
        bool, typer.Option(help="Run code that the bundle brings, in a process of its own.")
    ] = True,
    out: Annotated[
        Path | None, typer.Option(help="Append an accepted bundle's records to this folder.")
    ] = None,
    workers: Workers = None,
) -> None:
    """Check a bundle: hashes, weights, records, replay, and the controller on fresh seeds.

    Exit code 0: accepted; 1: not accepted, and why; 2: it is no bundle.
    """
    from benchmark.admission.submission import verifying
    from benchmark.plumbing.processes import cores
    from benchmark.records.store import Store

    store = Store(out, notice=console.notice) if out else None
    wishes = verifying.Wishes(fresh, fresh_seed or (), run_code, workers or cores())
    with store.writing() if store else nullcontext():
        found = verifying.verify(bundle, wishes)
        _show(bundle, found)
        if found.objections:
            raise typer.Exit(1)
        if store:
            held = {one.line() for one in store.records_of({one.scenario for one in found.records})}
            new = [one for one in found.records if one.line() not in held]
            for record in new:
                store.append(record)
            typer.echo(f"{len(new)} records appended to {store.records_folder}")


def _show(bundle: Path, found: "Verification") -> None:
    from rich.table import Table

    said = found.manifest
    for line in (
        f"{bundle}: {said.name} ({said.code.source}) by {', '.join(said.authors)}, {said.licence}",
        said.description,
        *([f"paper: {said.paper}"] if said.paper else []),
    ):
        console.stdout().print(console.literal(" ".join(line.split())), soft_wrap=True)
    table = Table("check", "verdict", "what was found", box=None)
    for check in found.checks:
        table.add_row(
            check.name,
            f"[{COLOURS[check.verdict]}]{check.verdict}[/]",
            console.literal(" ".join(check.words.split())),
        )
    console.stdout().print(table)
    names = ", ".join(check.name for check in found.objections)
    typer.echo(f"not accepted: {names}" if names else "accepted")

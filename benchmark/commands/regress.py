"""The command ``rightofway regress``."""

import os
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console, progress, suites
from benchmark.plumbing import files as output_files
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.records.measures import Column
    from benchmark.records.provenance import Provenance
    from benchmark.records.record import Record
    from benchmark.records.regression import Comparison
    from benchmark.scenario.scenario import Scenario
    from benchmark.study.suite import Suite

LOG_WIDTH = 160  # characters, of logs and pipes
SUMMARY = "GITHUB_STEP_SUMMARY"  # where GitHub Actions says to append Markdown


def regress(
    reference: Annotated[
        Path, typer.Option(help="Made by `rightofway reference update`; a results folder serves.")
    ] = Path("results/reference"),
    limit: Annotated[str, typer.Option(help="By how much a mean may rise: 5% or 0.05.")] = "5%",
    metric: Annotated[
        list[str] | None,
        typer.Option(help="Repeatable; a figure to compare; default: average_waiting_time."),
    ] = None,
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="Repeatable; files or folders with scenarios of yours."),
    ] = None,
    suite: Annotated[
        str | None,
        typer.Option(help="Compare only what this suite asks for; its scenarios are known too."),
    ] = None,
    controller: Annotated[
        list[str] | None, typer.Option(help="Repeatable; compare only these controllers.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes side by side; default: one per core.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Keep the new records in this folder.")] = None,
    records: Annotated[
        Path | None, typer.Option(help="Run nothing; compare the records of this results folder.")
    ] = None,
    markdown: Annotated[Path | None, typer.Option(help="Write a Markdown report.")] = None,
    junit: Annotated[Path | None, typer.Option(help="Write a JUnit XML report.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write a JSON report.")] = None,
) -> None:
    """Run a reference's episodes again and compare their figures, paired by seed.

    Exit codes: 0 fine, 1 something is worse or newly fails, 2 misuse or nothing to compare.
    """
    from benchmark.records import reference as references
    from benchmark.records import regression

    if records is not None and (out or workers or scenario):
        raise UsageError("--records runs nothing; leave out --out, --workers and --scenario")
    share, columns = parse_limit(limit), _columns(metric or [])
    held = references.read(reference, console.notice)
    declared = None if suite is None else suites.find(suite)
    wanted = _chosen(held.records, controller or [], declared)
    summary = os.environ.get(SUMMARY)
    reports = _Reports(markdown, junit, json_file, Path(summary) if summary else None)
    reports.prepare()
    reasons: dict[tuple[str, str], str] = {}
    if records is not None:
        new = _read(records)
    else:
        new, reasons = _run_again(wanted, _scenarios(scenario or [], declared), workers, out)
    comparison = regression.compare(wanted, new, share, columns, reasons)
    _show(comparison, wanted, new)
    reports.write(comparison, held.provenance)
    if comparison.exit_code == 2:
        raise UsageError(
            "nothing to compare: no episode of the reference met a counterpart with figures"
        )
    raise typer.Exit(comparison.exit_code)


def parse_limit(text: str) -> float:
    """A share, written as ``5%`` or ``0.05``.

    Raises:
        UsageError: it is neither, or makes no sense as a limit.
    """
    words = text.strip()
    try:
        number = float(words.removesuffix("%"))
    except ValueError:
        number = -1.0
    share = number / 100 if words.endswith("%") else number
    if not 0 <= number < float("inf"):
        raise UsageError(f'--limit "{text}": expected a share such as 5% or 0.05')
    if share > 1 and not words.endswith("%"):
        raise UsageError(
            f'--limit "{text}": {share:g} is {100 * share:g} %; did you mean "{words}%"?'
        )
    return share


def _columns(names: Sequence[str]) -> "list[Column]":
    from benchmark.plumbing.messages import nearest
    from benchmark.records.measures import COLUMNS, HEADLINE

    known = {column.key: column for column in COLUMNS}
    for name in names:
        if name not in known:
            raise UsageError(f'--metric "{name}": unknown{nearest(name, known)}')
    return [known[name] for name in dict.fromkeys(names)] or [HEADLINE]


def _chosen(
    held: "Sequence[Record]", controllers: Sequence[str], declared: "Suite | None"
) -> "list[Record]":
    """The reference's records that were asked for."""
    from benchmark.plumbing.messages import nearest

    known = sorted({record.controller for record in held})
    for name in controllers:
        if name not in known:
            raise UsageError(
                f'--controller "{name}": the reference has no such{nearest(name, known)}'
            )
    chosen = [one for one in held if not controllers or one.controller in controllers]
    return chosen if declared is None else _of_suite(chosen, declared)


def _of_suite(held: "Sequence[Record]", declared: "Suite") -> "list[Record]":
    """The records of a suite's episodes; a scenario counts by its name or its content."""
    asked = {
        (scenario, one.controller, one.rate, one.seed): index
        for index, one in enumerate(suites.episodes_of(declared))
        for scenario in (one.scenario.name, one.scenario.hash)
    }
    chosen, met = [], set()
    for record in held:
        rest = (record.controller, record.rate, record.seed)
        keys = ((record.scenario_hash, *rest), (record.scenario, *rest))
        if found := [asked[key] for key in keys if key in asked]:
            chosen.append(record)
            met.update(found)
    if left := len(held) - len(chosen):
        console.notice(f"{left} records of the reference are left out; the suite does not ask")
    if new := len({*asked.values()} - met):
        console.notice(f"{new} episodes of the suite have no reference, and are not compared")
    return chosen


def _scenarios(references: Sequence[str], declared: "Suite | None") -> "list[Scenario]":
    from benchmark.scenario import catalogue

    return [*catalogue.find(references), *(declared.load_scenarios() if declared else ())]


def _read(folder: Path) -> "list[Record]":
    from benchmark.records.store import Store

    folder = folder.parent if folder.name == "records" else folder
    return Store(folder, notice=console.notice).read()


def _run_again(
    wanted: "Sequence[Record]", given: "Sequence[Scenario]", workers: int | None, out: Path | None
) -> "tuple[list[Record], dict[tuple[str, str], str]]":
    """The new records, and why some scenarios have none."""
    from benchmark.plumbing.processes import cores
    from benchmark.records.store import Store
    from benchmark.study import episodes, repeats
    from benchmark.study.pool import LocalPool

    planned = repeats.plan(wanted, given)
    store = None if out is None else Store(out, notice=console.notice)
    new: list[Record] = []
    try:
        with ExitStack() as stack:
            if store is not None:
                stack.enter_context(store.writing())
            episodes.prepare(planned.episodes)
            running = progress.run(LocalPool(workers or cores()), planned.episodes)
            for _, record in stack.enter_context(closing(running)):
                new.append(record)
                if store is not None:
                    store.append(record)
    except KeyboardInterrupt:
        console.notice(f"stopped after {len(new)} of {len(planned.episodes)} episodes, no verdict")
        raise
    return new, planned.incomparable


def _show(comparison: "Comparison", wanted: "Sequence[Record]", new: "Sequence[Record]") -> None:
    """Print everything, the outcome last."""
    from benchmark.reports.regression import terminal, words

    before, now = ({one.versions.sumo for one in held} for held in (wanted, new))
    if now and before != now:
        console.notice(
            f"the reference was made with SUMO {' and '.join(sorted(before))}, the new records "
            f"with {' and '.join(sorted(now))}: figures may differ for that alone"
        )
    screen = console.stdout()
    if not screen.is_terminal and "COLUMNS" not in os.environ:
        screen.width = LOG_WIDTH
    for table in terminal.tables(comparison, screen.width):
        screen.print(table)
        screen.print()
    for remark in words.remarks(comparison.rows):
        console.notice(remark)
    screen.print(words.headline(comparison), soft_wrap=True)


@dataclass(frozen=True)
class _Reports:
    """The files that were asked for, and GitHub's summary where there is one."""

    markdown: Path | None
    junit: Path | None
    json: Path | None
    summary: Path | None

    def prepare(self) -> None:
        files = (self.markdown, self.junit, self.json, self.summary)
        output_files.prepare(one for one in files if one is not None)

    def write(self, comparison: "Comparison", made: "Provenance | None") -> None:
        from benchmark.reports.regression import document, junit, markdown

        text = markdown.markdown(comparison, made.words() if made else "")
        if self.markdown:
            output_files.write(self.markdown, text)
        if self.summary:
            output_files.append(self.summary, text)
        if self.junit:
            output_files.write(self.junit, junit.junit(comparison))
        if self.json:
            output_files.write(self.json, document.as_json(comparison, made))

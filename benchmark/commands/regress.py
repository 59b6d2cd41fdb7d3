"""The command ``rightofway regress``."""

import os
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console
from benchmark.commands.choice import suite_named
from benchmark.commands.options import Workers
from benchmark.commands.progress import progress_bar
from benchmark.plumbing import files as output_files
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.records.measures import Measure
    from benchmark.records.provenance import Provenance
    from benchmark.records.record import Record
    from benchmark.records.regression import RegressionCheck
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
    workers: Workers = None,
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
    share, measures = parse_limit(limit), _measures(metric or [])
    old = references.read_reference(reference, console.notice)
    declared = None if suite is None else suite_named(suite)
    wanted = _chosen(old.records, controller or [], declared)
    summary = os.environ.get(SUMMARY)
    reports = _Reports(markdown, junit, json_file, Path(summary) if summary else None)
    reports.prepare()
    reasons: dict[tuple[str, str], str] = {}
    if records is not None:
        new = _read(records)
    else:
        new, reasons = _run_again(wanted, _scenarios(scenario or [], declared), workers, out)
    check = regression.compare(wanted, new, share, measures, reasons)
    _show(check, wanted, new)
    reports.write(check, old.provenance)
    if check.exit_code == 2:
        raise UsageError(
            "nothing to compare: no episode of the reference met a counterpart with figures"
        )
    raise typer.Exit(check.exit_code)


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


def _measures(names: Sequence[str]) -> "list[Measure]":
    from benchmark.plumbing.messages import nearest
    from benchmark.records.measures import BY_KEY, HEADLINE

    for name in names:
        if name not in BY_KEY:
            raise UsageError(f'--metric "{name}": unknown{nearest(name, BY_KEY)}')
    return [BY_KEY[name] for name in dict.fromkeys(names)] or [HEADLINE]


def _chosen(
    records: "Sequence[Record]", controllers: Sequence[str], declared: "Suite | None"
) -> "list[Record]":
    """The reference's records that were asked for."""
    from benchmark.plumbing.messages import nearest

    known = sorted({record.controller for record in records})
    for name in controllers:
        if name not in known:
            raise UsageError(
                f'--controller "{name}": the reference has no such{nearest(name, known)}'
            )
    chosen = [record for record in records if not controllers or record.controller in controllers]
    return chosen if declared is None else _of_suite(chosen, declared)


def _of_suite(records: "Sequence[Record]", declared: "Suite") -> "list[Record]":
    """The records of a suite's episodes; a scenario counts by its name or its content."""
    from benchmark.study.episodes import episodes_of

    asked = {
        (scenario, episode.controller, episode.rate, episode.seed): index
        for index, episode in enumerate(episodes_of(declared))
        for scenario in (episode.scenario.name, episode.scenario.hash)
    }
    chosen, met = [], set()
    for record in records:
        rest = (record.controller, record.rate, record.seed)
        keys = ((record.scenario_hash, *rest), (record.scenario, *rest))
        if indices := [asked[key] for key in keys if key in asked]:
            chosen.append(record)
            met.update(indices)
    if left := len(records) - len(chosen):
        console.notice(f"{left} records of the reference are left out; the suite does not ask")
    if new := len({*asked.values()} - met):
        console.notice(f"{new} episodes of the suite have no reference, and are not compared")
    return chosen


def _scenarios(references: Sequence[str], declared: "Suite | None") -> "list[Scenario]":
    from benchmark.scenario import catalogue

    return [*catalogue.find_scenarios(references), *(declared.load_scenarios() if declared else ())]


def _read(folder: Path) -> "list[Record]":
    from benchmark.records.store import Store

    return Store(output_files.results_folder(folder), notice=console.notice).read()


def _run_again(
    wanted: "Sequence[Record]", given: "Sequence[Scenario]", workers: int | None, out: Path | None
) -> "tuple[list[Record], dict[tuple[str, str], str]]":
    """The new records, and why some scenarios have none."""
    from benchmark.plumbing.processes import cores
    from benchmark.records.store import Store
    from benchmark.study.episodes import build_ahead
    from benchmark.study.pool import LocalPool
    from benchmark.study.repeats import repeats_of

    repeats = repeats_of(wanted, given)
    store = None if out is None else Store(out, notice=console.notice)
    new: list[Record] = []
    try:
        with ExitStack() as stack:
            if store is not None:
                stack.enter_context(store.writing())
            build_ahead(repeats.episodes)
            advance = stack.enter_context(progress_bar(repeats.episodes))
            running = LocalPool(workers or cores()).run(repeats.episodes)
            for episode, record in stack.enter_context(closing(running)):
                new.append(record)
                if store is not None:
                    store.append(record)
                advance(episode, record)
    except KeyboardInterrupt:
        console.notice(f"stopped after {len(new)} of {len(repeats.episodes)} episodes, no verdict")
        raise
    return new, repeats.incomparable


def _show(check: "RegressionCheck", wanted: "Sequence[Record]", new: "Sequence[Record]") -> None:
    """Print everything, the outcome last."""
    from benchmark.reports.regression import phrases, terminal

    before = {record.versions.sumo for record in wanted}
    now = {record.versions.sumo for record in new}
    if now and before != now:
        console.notice(
            f"the reference was made with SUMO {' and '.join(sorted(before))}, the new records "
            f"with {' and '.join(sorted(now))}: figures may differ for that alone"
        )
    screen = console.stdout()
    if not screen.is_terminal and "COLUMNS" not in os.environ:
        screen.width = LOG_WIDTH
    for table in terminal.regression_tables(check, screen.width):
        screen.print(table)
        screen.print()
    for remark in phrases.remark_lines(check.findings):
        console.notice(remark)
    screen.print(phrases.outcome_sentence(check), soft_wrap=True)


@dataclass(frozen=True)
class _Reports:
    """The files that were asked for, and GitHub's summary where there is one."""

    markdown: Path | None
    junit: Path | None
    json: Path | None
    summary: Path | None

    def prepare(self) -> None:
        files = (self.markdown, self.junit, self.json, self.summary)
        output_files.prepare(path for path in files if path is not None)

    def write(self, check: "RegressionCheck", made: "Provenance | None") -> None:
        from benchmark.reports.regression import document, junit, markdown

        text = markdown.regression_markdown(check, made.words() if made else "")
        if self.markdown:
            output_files.write(self.markdown, text)
        if self.summary:
            output_files.append(self.summary, text)
        if self.junit:
            output_files.write(self.junit, junit.junit_xml(check))
        if self.json:
            output_files.write(self.json, document.regression_json(check, made))

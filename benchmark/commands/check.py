"""The command ``rightofway check``: scenarios, ``check controller``, or ``check isolation``."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console
from benchmark.plumbing.errors import ControllerError, UsageError

if TYPE_CHECKING:
    from benchmark.admission.conformance import Result

CONTROLLER = "controller"  # the word that turns what follows into controllers
ISOLATION = "isolation"  # the word for this system's walls around isolated controllers
STYLES = {"passed": "green", "failed": "bold red", "skipped": "yellow"}


def check(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO... | controller NAME... | isolation",
            help="Scenarios as files, folders or shipped names; or the word controller, then "
            "controllers as NAME, file.py:Class or package.module:Class, with options or without; "
            "or the word isolation.",
        ),
    ],
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="Repeatable; where controllers are checked; default: smoke."),
    ] = None,
) -> None:
    """Say what is wrong with scenarios, with controllers, or with this system's isolation.

    Scenarios are validated, built and routed. Lines that begin with ! are findings; what cannot
    run at all is an error with exit code 2.

    Controllers go through the conformance kit: whether they keep to the contract, repeat
    themselves, forget, and how long they take. Exit code 1: some check failed.

    The word isolation tries on this system what an isolated controller might. Exit code 1: some
    attempt gets through.
    """
    if what == [ISOLATION] and not Path(ISOLATION).exists():
        if scenario:
            raise UsageError("--scenario goes with `check controller`, not with `check isolation`")
        _check_isolation()
        return
    if what[0] != CONTROLLER or (what == [CONTROLLER] and Path(CONTROLLER).exists()):
        if scenario:
            raise UsageError("--scenario goes with `check controller`; give scenarios as they are")
        _check_scenarios(what)
        return
    if len(what) == 1:
        raise UsageError("which controller? Expected rightofway check controller NAME")
    _check_controllers(what[1:], scenario or ["smoke"])


def _check_scenarios(references: Sequence[str]) -> None:
    from rich.table import Table

    from benchmark.scenario import catalogue
    from benchmark.sumo.inspection import SEEDS_ROUTED, inspect
    from benchmark.world.unregulated import too_short

    vehicles = [f"veh in {SEEDS_ROUTED} seeds ({of})" for of in ("counts", "routes")]
    columns = ("movement", *vehicles, "share (counts)", "share (routes)", "saturation")
    for scenario in catalogue.find_scenarios(references):
        inspection = inspect(scenario)
        hashes = f"{scenario.hash[:12]}, network {inspection.network_hash[:12]}"
        table = Table(*columns, title=f"{scenario.name} {hashes}", title_justify="left")
        several = len(inspection.shares) > 1
        for junction, shares in inspection.shares.items():
            degrees = inspection.saturation.get(junction, {})
            for share in shares:
                degree = degrees.get(share.movement)
                table.add_row(
                    f"{junction} {share.movement}" if several else share.movement,
                    f"{share.expected_vehicles:.0f}",
                    str(share.vehicles),
                    f"{share.wanted:.1%}",
                    f"{share.realised:.1%}",
                    "-" if degree is None else f"{degree:.2f}",
                )
        console.stdout().print(table)
        findings = [*inspection.findings, *filter(None, [too_short(scenario)])]
        for finding in findings:
            console.stdout().print(f"[yellow]![/] {console.literal(finding)}", soft_wrap=True)
        count = len(findings)
        console.stdout().print(f"{count} finding{'s' * (count != 1)}\n" if count else "all well\n")


def _check_controllers(references: Sequence[str], scenarios: Sequence[str]) -> None:
    from benchmark.admission.conformance import check_controller
    from benchmark.control import plugins

    once = dict.fromkeys(references)
    controllers = [
        plugins.find_controller(reference) for reference in once
    ]  # all, before any is run
    failed = 0
    for plugin in controllers:
        results = check_controller(plugin.reference, scenarios)
        _print(f"{plugin.label} ({plugins.provenance(plugin.reference)})", results)
        failed += any(result.status == "failed" for result in results)
    if failed:
        raise typer.Exit(1)


def _check_isolation() -> None:
    from rich.table import Table

    from benchmark.control.guard import ControllerFailedError
    from benchmark.control.isolation.probe import probe

    try:
        verdicts = probe()
    except ControllerFailedError as error:
        raise ControllerError(f"isolation cannot be tried: {error}") from error
    table = Table("isolation keeps out", "verdict", "what was tried", "what it needs")
    for verdict in verdicts:
        style, word = (STYLES["failed"], "open") if verdict.open else (STYLES["passed"], "held")
        told = f"got through: {', '.join(verdict.open)}" if verdict.open else ""
        tries = console.literal(told or ", ".join(verdict.outcomes))
        protection = verdict.protection
        table.add_row(protection.name, f"[{style}]{word}[/]", tries, protection.needs)
    console.stdout().print(table)
    count = sum(bool(verdict.open) for verdict in verdicts)
    console.stdout().print(f"{len(verdicts) - count} held, {count} open\n")
    if count:
        raise typer.Exit(1)


def _print(title: str, results: "Sequence[Result]") -> None:
    from rich.table import Table

    table = Table(
        "check", "scenario", "verdict", "why", title=console.literal(title), title_justify="left"
    )
    for check, scenarios, status, words in _gathered(results):
        style = STYLES[status]
        table.add_row(check, "\n".join(scenarios), f"[{style}]{status}[/]", console.literal(words))
    console.stdout().print(table)
    counts = {status: sum(result.status == status for result in results) for status in STYLES}
    summary = ", ".join(f"{count} {status}" for status, count in counts.items() if count)
    console.stdout().print(f"{summary}\n")


def _gathered(results: "Iterable[Result]") -> list[tuple[str, list[str], str, str]]:
    """Results with the scenarios on which they are the same put together."""
    rows: dict[tuple[str, str, str], list[str]] = {}
    for result in results:
        key = result.check, result.status, result.words
        rows.setdefault(key, []).append(result.scenario)
    return [(check, where, status, words) for (check, status, words), where in rows.items()]

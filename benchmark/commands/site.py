"""The commands ``rightofway site`` and ``rightofway serve``."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console
from benchmark.commands.options import Records
from benchmark.plumbing.errors import RightOfWayError, ScenarioError, UsageError

if TYPE_CHECKING:
    from benchmark.records.record import Record
    from benchmark.scenario.scenario import Scenario

HIGHEST_PORT = 65535


def site(
    records: Records = Path("out"),
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the pages.")] = Path(
        "site"
    ),
    scenario: Annotated[
        list[str] | None,
        typer.Option(
            "--scenario", help="A file or folder of scenarios of your own; may be repeated."
        ),
    ] = None,
) -> None:
    """Write the results as pages that open from a file; needs SUMO for drawings only."""
    from benchmark.reports.site import build, replays
    from benchmark.reports.site.contents import Contents

    build.check_target(output)
    read = _read(records)
    files = _files(read, scenario or ())
    drawings = _drawings(files)
    contents = Contents.of(read, files, drawings, replays.replays_in(records))
    count = build.build_site(contents, output)
    console.say(f"{output / 'index.html'}: {count} pages from {len(contents.records)} records")


def serve(
    folder: Annotated[Path, typer.Argument(help="A folder that `rightofway site` wrote.")] = Path(
        "site"
    ),
    port: Annotated[int, typer.Option(min=0, max=HIGHEST_PORT, help="0: any free one.")] = 8000,
) -> None:
    """Show a site on this machine, and on this machine only."""
    from benchmark.reports.site.server import site_server

    with site_server(folder, port) as running:
        console.say(f"http://127.0.0.1:{running.server_port}/ (Ctrl-C ends it)")
        try:
            running.serve_forever()
        except KeyboardInterrupt:
            console.say("")


def _read(folder: Path) -> "list[Record]":
    """The records of a results folder; none where it has none yet."""
    from benchmark.records.store import Store

    store = Store(folder, notice=console.notice)
    if not folder.is_dir():
        raise UsageError(
            f"{folder}: no such folder; make records with `rightofway run --out {folder}`"
        )
    if not store.has_some:
        console.notice(f"{folder}: no records here, so the pages are empty")
        return []
    return store.read()


def _files(records: "Iterable[Record]", given: Iterable[str]) -> "Mapping[str, Scenario]":
    """The scenarios of records by hash, as far as their files are at hand and unchanged."""
    from benchmark.scenario import catalogue

    at_hand = {scenario.hash: scenario for scenario in catalogue.find_scenarios(given)}
    wanted = sorted({(record.scenario, record.scenario_hash) for record in records})
    for name, scenario_hash in wanted:
        if scenario_hash in at_hand:
            continue
        try:
            candidates = catalogue.find_scenarios([name])
        except ScenarioError:
            continue  # its page says that the file is not at hand
        at_hand |= {scenario.hash: scenario for scenario in candidates if scenario.name == name}
    return {known: at_hand[known] for _, known in wanted if known in at_hand}


def _drawings(files: "Mapping[str, Scenario]") -> dict[str, dict[str, str]]:
    """Plans and turning counts as SVG, where SUMO can build the network."""
    drawings = {}
    for scenario_hash, scenario in files.items():
        try:
            from benchmark.pictures.sheet import whole

            drawings[scenario_hash] = whole.panels(scenario)
        except ImportError as error:  # of SUMO's packages, which come in only when it is run
            console.notice(f"no drawings, as they need SUMO: {error}")
            break
        except RightOfWayError as error:
            console.notice(f"{scenario.name}: no drawing: {error}")
    return drawings

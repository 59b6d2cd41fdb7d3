"""The command ``rightofway replay``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console

if TYPE_CHECKING:
    from benchmark.action_log import ActionLog
    from benchmark.record import Record


def replay(
    source: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Files that `run --log-actions` wrote.")
    ],
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes side by side; default: one per core.")
    ] = None,
) -> None:
    """Score the commands of action logs again, without the controller that gave them.

    Exit code 0: every record comes out as it was, bit for bit; 1: some do not.
    """
    from benchmark import action_log, replay, suite
    from benchmark.local import cores

    logs = {path: action_log.read(path) for path in dict.fromkeys(source)}
    for log in logs.values():
        replay.check_scenario(log)
    episodes = [replay.LoggedEpisode.of(log) for log in logs.values()]
    suite.prepare(episodes)
    found: dict[object, Record] = {
        record.episode: record
        for record in suite.run_all(episodes, workers or cores(), work=replay.score)
    }
    told = [_tell(log, found[log.record.episode]) for log in logs.values()]
    if not all(told):
        raise typer.Exit(1)


def _tell(log: "ActionLog", again: "Record") -> bool:
    """Say whether a record came out as it was."""
    from benchmark import replay

    differing = replay.differences(log.record, again)
    versions = replay.versions_differ(log.record, again)
    if not differing:
        waits = ", ".join(
            f"{junction.average_waiting_time:.2f} s"
            for junction in again.junctions.values()
            if junction.average_waiting_time is not None
        )
        who = f"{again.controller} on {again.scenario}, rate {again.rate}, seed {again.seed}"
        typer.echo(
            f"{log.path}: the same, bit for bit: {who}: average waiting time {waits or '-'} "
            f"from {len(log.actions)} commands"
        )
    else:
        more = f"; and {len(differing) - 3} more" if len(differing) > 3 else ""
        console.notice(f"{log.path}: comes out otherwise: {'; '.join(differing[:3])}{more}")
    if versions is not None:
        console.notice(f"{log.path}: versions: {versions}")
    elif differing:
        console.notice("the versions are the same: the log's commands or record were changed")
    return not differing

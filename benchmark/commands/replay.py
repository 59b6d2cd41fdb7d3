"""The command ``rightofway replay``."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console
from benchmark.commands.options import LARGEST_SEED, Workers, rate_option
from benchmark.plumbing.errors import UsageError

if TYPE_CHECKING:
    from benchmark.pictures.replay.replay import Replay
    from benchmark.records.record import Record
    from benchmark.study.action_log import ActionLog
    from benchmark.study.rescoring import LoggedEpisode

RATE, SEED = 0.5, 1
PAGE = Path("replay.html")


def replay(
    source: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO|LOG...",
            help="With --controller a scenario; else files that `run --log-actions` wrote.",
        ),
    ],
    controller: Annotated[
        list[str] | None,
        typer.Option("--controller", help="Whom to watch; repeat it to see them side by side."),
    ] = None,
    rate: Annotated[
        list[float] | None,
        rate_option("--rate", words=f"Repeatable; default: {RATE}."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=LARGEST_SEED, help=f"Default: {SEED}.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help=f"The page that plays it; default with --controller: {PAGE}."
        ),
    ] = None,
    gif: Annotated[Path | None, typer.Option("--gif", help="A film for slides.")] = None,
    mp4: Annotated[
        Path | None, typer.Option("--mp4", help="The same; needs rightofway[video].")
    ] = None,
    begin: Annotated[
        float | None, typer.Option("--from", help="Where the film begins [s]; default: warm-up.")
    ] = None,
    end: Annotated[
        float | None, typer.Option("--to", help="Where it ends [s]; default: a minute later.")
    ] = None,
    speed: Annotated[
        float, typer.Option(min=0.1, max=100, help="Seconds of the episode in one of the film.")
    ] = 4.0,
    workers: Workers = None,
) -> None:
    """Write a page that plays an episode, or score the commands of action logs again.

    Logs are scored without the controller that gave the commands; exit code 0: every record comes
    out as it was, bit for bit; 1: some do not.
    """
    films = {"--gif": gif, "--mp4": mp4}
    if not (gif or mp4) and (begin is not None or end is not None):
        raise UsageError("--from and --to choose what a film shows; give --gif or --mp4 too")
    if controller:
        if output is None and not (gif or mp4):
            output = PAGE
        _prepare(output, films)
        shown = _watched(source, controller, rate or [RATE], SEED if seed is None else seed)
        _write(shown, output, films, begin, end, speed)
        return
    if rate or seed is not None:
        raise UsageError("--rate and --seed go with a scenario; name who drives with --controller")
    _prepare(output, films)
    wanted = output is not None or gif is not None or mp4 is not None
    same, rescored = _scored(list(map(Path, source)), workers, wanted=wanted)
    if rescored is not None:
        _write(rescored, output, films, begin, end, speed)
    if not same:
        raise typer.Exit(1)


def _prepare(output: Path | None, films: dict[str, Path | None]) -> None:
    """Make sure that what is asked for can be written, before anything is run."""
    from benchmark.pictures.replay import film
    from benchmark.plumbing import files

    for option, path in films.items():
        if path is not None and film.check_kind(path) != f".{option[2:]}":
            raise UsageError(f"{path}: {option} writes another kind; end its name in .{option[2:]}")
    files.prepare(path for path in (output, *films.values()) if path is not None)


def _watched(
    source: Sequence[str], controllers: Sequence[str], rates: Sequence[float], seed: int
) -> "Replay":
    from benchmark.pictures.replay.page import page
    from benchmark.pictures.replay.replay import Replay
    from benchmark.plumbing.errors import TrajectoryError
    from benchmark.scenario import catalogue
    from benchmark.study.episodes import all_episodes, build_ahead

    if len(source) > 1:
        raise UsageError(f"one scenario at a time, not {len(source)}: {', '.join(source)}")
    episodes = all_episodes([catalogue.find_scenario(source[0])], controllers, rates, [seed])
    page.check_together([episode.record("ok") for episode in episodes])
    build_ahead(episodes)
    try:
        return Replay.of(*episodes)
    except TrajectoryError as error:
        console.notice(str(error))
        raise typer.Exit(1) from error


def _scored(
    paths: Sequence[Path], workers: int | None, *, wanted: bool
) -> "tuple[bool, Replay | None]":
    """Whether all logs come out as they were, and what is to be shown of them."""
    from benchmark.plumbing.processes import cores
    from benchmark.study import action_log, rescoring
    from benchmark.study.episodes import build_ahead
    from benchmark.study.pool import LocalPool

    logs = {path: action_log.read_log(_log(path)) for path in dict.fromkeys(paths)}
    for log in logs.values():
        rescoring.check_scenario(log)
    episodes = [rescoring.LoggedEpisode.of(log) for log in logs.values()]
    build_ahead(episodes)
    again: dict[object, Record]
    shown = None
    if wanted:
        again, shown = _recorded(episodes)
    else:
        running = LocalPool(workers or cores(), work=rescoring.rescore).run(episodes)
        again = {record.episode: record for _, record in running}
    same = [_tell(log, again[log.record.episode]) for log in logs.values()]
    return all(same), shown


def _log(path: Path) -> Path:
    """A log's path; a scenario without a controller is a slip that deserves its own words."""
    from benchmark.plumbing.errors import ScenarioError
    from benchmark.scenario import catalogue

    if path.is_file() and path.suffix != ".toml":
        return path
    with suppress(ScenarioError):
        catalogue.find_scenario(str(path))
        raise UsageError(f"{path}: a scenario; name who drives with --controller")
    return path


def _recorded(
    episodes: "Sequence[LoggedEpisode]",
) -> "tuple[dict[object, Record], Replay | None]":
    """The records of logs when they are scored again, and what there is to see of them."""
    from benchmark.pictures.replay.page import page
    from benchmark.pictures.replay.recorder import Recorder
    from benchmark.pictures.replay.replay import Replay
    from benchmark.study import rescoring

    page.check_together([episode.record("ok") for episode in episodes])
    records: dict[object, Record] = {}
    trajectories = []
    for episode in episodes:
        recorder = Recorder()
        record = rescoring.rescore(episode, recorder)
        records[record.episode] = record
        if record.status == "ok":
            trajectories.append(recorder.trajectories(record))
    return records, Replay(trajectories) if trajectories else None


def _write(
    shown: "Replay",
    output: Path | None,
    films: dict[str, Path | None],
    begin: float | None,
    end: float | None,
    speed: float,
) -> None:
    """Write the page and the films, and say where they are."""
    if output is not None:
        shown.write(output)
        console.say(str(output))
    for path in films.values():
        if path is not None:
            shown.film(path, begin, end, speed)
            console.say(str(path))


def _tell(log: "ActionLog", again: "Record") -> bool:
    """Say whether a record came out as it was."""
    from benchmark.study import rescoring

    differing = rescoring.contradictions(log.record, again)
    versions = rescoring.versions_differ(log.record, again)
    if not differing:
        waits = ", ".join(
            f"{junction.average_waiting_time:.2f} s"
            for junction in again.junctions.values()
            if junction.average_waiting_time is not None
        )
        who = f"{again.controller} on {again.scenario}, rate {again.rate}, seed {again.seed}"
        console.say(
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

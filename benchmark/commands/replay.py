"""The command ``rightofway replay``."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchmark.commands import console
from benchmark.commands.choice import LARGEST_SEED
from benchmark.errors import UsageError

if TYPE_CHECKING:
    from benchmark.action_log import ActionLog
    from benchmark.playback import Replay
    from benchmark.record import Record

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
        typer.Option("--rate", min=0, max=1, help=f"Repeatable; default: {RATE}."),
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
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes side by side; default: one per core.")
    ] = None,
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
        found = _watched(source, controller, rate or [RATE], SEED if seed is None else seed)
        _write(found, output, films, begin, end, speed)
        return
    if rate or seed is not None:
        raise UsageError("--rate and --seed go with a scenario; name who drives with --controller")
    _prepare(output, films)
    wanted = output is not None or gif is not None or mp4 is not None
    same, shown = _scored([Path(one) for one in source], workers, wanted=wanted)
    if shown is not None:
        _write(shown, output, films, begin, end, speed)
    if not same:
        raise typer.Exit(1)


def _prepare(output: Path | None, films: dict[str, Path | None]) -> None:
    """Make sure that what is asked for can be written, before anything is run."""
    from benchmark.commands import output_files
    from benchmark.film import film

    for option, path in films.items():
        if path is not None and film.check_kind(path) != f".{option[2:]}":
            raise UsageError(f"{path}: {option} writes another kind; end its name in .{option[2:]}")
    output_files.prepare(one for one in (output, *films.values()) if one is not None)


def _watched(
    source: Sequence[str], controllers: Sequence[str], rates: Sequence[float], seed: int
) -> "Replay":
    from benchmark import catalogue, episode, suite
    from benchmark.playback import Replay
    from benchmark.recorder import Recorder
    from benchmark.site.viewer import page

    if len(source) > 1:
        raise UsageError(f"one scenario at a time, not {len(source)}: {', '.join(source)}")
    once = dict.fromkeys
    chosen = suite.episodes(
        [catalogue.one(source[0])], list(once(controllers)), list(once(rates)), [seed]
    )
    page.check_together([one.record("ok") for one in chosen])
    suite.prepare(chosen)
    kept = []
    for one in chosen:
        recorder = Recorder()
        record = episode.run(one, recorder=recorder)
        if record.status != "ok":
            console.notice(f"{record.controller}: nothing to show, {record.status}: {record.reason}")
            raise typer.Exit(1)
        kept.append(recorder.trajectories(record))
    return Replay(kept)


def _scored(
    paths: Sequence[Path], workers: int | None, *, wanted: bool
) -> "tuple[bool, Replay | None]":
    """Whether all logs come out as they were, and what is to be shown of them."""
    from benchmark import action_log, replay, suite
    from benchmark.local import cores

    logs = {path: action_log.read(_log(path)) for path in dict.fromkeys(paths)}
    for log in logs.values():
        replay.check_scenario(log)
    episodes = [replay.LoggedEpisode.of(log) for log in logs.values()]
    suite.prepare(episodes)
    shown, found = None, dict[object, Record]()
    if wanted:
        found, shown = _recorded(episodes)
    else:
        again = suite.run_all(episodes, workers or cores(), work=replay.score)
        found = {record.episode: record for record in again}
    told = [_tell(log, found[log.record.episode]) for log in logs.values()]
    return all(told), shown

"""Episodes to look at: run and recorded, shown in a notebook, as pages and as films."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Self

from markupsafe import Markup

from benchmark.pictures.replay import film
from benchmark.pictures.replay.page import page
from benchmark.pictures.replay.recorder import Recorder
from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.plumbing import files
from benchmark.plumbing.errors import StoreError, TrajectoryError, UsageError
from benchmark.records.record import Record
from benchmark.reports.site import replays
from benchmark.study import action_log
from benchmark.study.action_log import Key
from benchmark.study.episode import Audience, Episode, run
from benchmark.study.rescoring import run_logged

FRAME = Markup(
    '<iframe title="{}" srcdoc="{}" sandbox="allow-scripts" loading="lazy" '
    'style="width: 100%; height: 760px; border: 1px solid #8884; border-radius: 8px"></iframe>'
)


class Replay:
    """Recorded episodes of the same traffic, side by side; a notebook plays them.

    Args:
        kept: what was recorded, of one scenario and seed.

    Raises:
        TrajectoryError: there are none, more than fit a page, or they are not the same traffic.
    """

    def __init__(self, kept: Sequence[Trajectories]) -> None:
        page.check_together([one.record for one in kept])
        self.kept = tuple(kept)

    @classmethod
    def of(cls, *episodes: Episode) -> Self:
        """Run episodes, one after the other, and keep where everybody was.

        Raises:
            TrajectoryError: one does not end well, or they are not the same traffic.
            RightOfWayError: a scenario cannot be run.
        """
        page.check_together([one.record("ok") for one in episodes])
        return cls([recorded(one) for one in episodes])

    @property
    def records(self) -> tuple[Record, ...]:
        """What the episodes left behind."""
        return tuple(one.record for one in self.kept)

    def write(self, path: Path | str) -> Path:
        """Write the page that plays them; it needs no network.

        Raises:
            UsageError: the disk refuses.
        """
        return _write(Path(path), page.page(self.kept))

    def film(
        self,
        path: Path | str,
        begin: float | None = None,
        end: float | None = None,
        speed: float = film.SPEED,
    ) -> Path:
        """Write a film, GIF or MP4 by the name's ending.

        Args:
            path: where; MP4 needs the extra ``rightofway[video]``.
            begin: of what it shows [s]; the first second that counts if not given.
            end: of what it shows [s]; a minute later if not given.
            speed: seconds of the episode in one of the film.

        Raises:
            TrajectoryError: there is nothing to show between the two, or too much for a film.
            UsageError: the file cannot be written, or its ending is none of a film.
        """
        target = Path(path)
        film.write(self.kept, target, film.Range.of(self.kept[0], begin, end, speed))
        return target

    def __repr__(self) -> str:
        first = self.records[0]
        names = " and ".join(one.controller for one in self.records)
        return f"Replay({names} on {first.scenario}, seed {first.seed})"

    def _repr_html_(self) -> str:
        return FRAME.format(repr(self), page.page(self.kept))


def recorded(episode: Episode) -> Trajectories:
    """Run an episode and keep where everybody was.

    Raises:
        TrajectoryError: it does not end well.
        RightOfWayError: the scenario cannot be run.
    """
    recorder = Recorder()
    record = run(episode, Audience(onlooker=recorder))
    if record.status != "ok":
        raise TrajectoryError(
            f"{record.controller} on {record.scenario}, seed {record.seed}: nothing to show, "
            f"{record.status}: {record.reason}"
        )
    return recorder.trajectories(record)


# --- a replay for each record of a results folder --------------------------------------------


def folder_in(results: Path) -> Path:
    """Where a results folder keeps its replays; the results site links them from there."""
    return results / replays.FOLDER


def run_recorded(episode: Episode, pages: Path, actions: Path | None = None) -> Record:
    """Run an episode and write the page that plays it; one that does not end well leaves none.

    Args:
        episode: what to run.
        pages: the folder for the page.
        actions: that for its action log, if one is wanted.

    Raises:
        RightOfWayError: the scenario cannot be run.
        StoreError: the disk refuses.
    """
    recorder = Recorder()
    if actions is None:
        record = run(episode, Audience(onlooker=recorder))
    else:
        record = run_logged(episode, actions, recorder)
    if record.status == "ok":
        try:
            _write(pages / name_of(record.episode), page.page([recorder.trajectories(record)]))
        except UsageError as error:  # nothing about this episode is wrong: the suite has to stop
            raise StoreError(str(error)) from error
    return record


def prepare(pages: Path) -> None:
    """Make sure that replays can be written, before any episode is run.

    Raises:
        StoreError: the folder cannot be made or written.
    """
    files.prepare_folder(pages, "replays")


def name_of(episode: Key) -> str:
    """The file's name, as that of its action log."""
    return Path(action_log.name_of(episode)).with_suffix(".html").name


def is_kept(pages: Path, episode: Key, identity: str) -> bool:
    """Whether a folder has the replay of just this episode."""
    with suppress(OSError), (pages / name_of(episode)).open(encoding="utf-8") as file:
        return page.shows(file.read(page.HEAD)) == [identity]
    return False


def _write(path: Path, text: str) -> Path:
    """Write a file, whole or not at all."""
    with files.writing(path, "the replay"):
        path.parent.mkdir(parents=True, exist_ok=True)
        with files.replaced(path) as draft:
            draft.write_text(text, encoding="utf-8", errors="replace")
    return path

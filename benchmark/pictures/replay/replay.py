"""Episodes to look at: run and recorded, shown in a notebook, as pages and as films."""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

from markupsafe import Markup

from benchmark.pictures.replay import film
from benchmark.pictures.replay.page import page
from benchmark.pictures.replay.recorder import Recorder
from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.plumbing.errors import TrajectoryError
from benchmark.records.record import Record
from benchmark.study.episode import Audience, Episode, run_episode

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
        page.check_together([episode.record for episode in kept])
        self.kept = tuple(kept)

    @classmethod
    def of(cls, *episodes: Episode) -> Self:
        """Run episodes, one after the other, and keep where everybody was.

        Raises:
            TrajectoryError: one does not end well, or they are not the same traffic.
            RightOfWayError: a scenario cannot be run.
        """
        page.check_together([episode.record("ok") for episode in episodes])
        return cls([recorded(episode) for episode in episodes])

    @property
    def records(self) -> tuple[Record, ...]:
        """What the episodes left behind."""
        return tuple(episode.record for episode in self.kept)

    def write(self, path: Path | str) -> Path:
        """Write the page that plays them; it needs no network.

        Raises:
            UsageError: the disk refuses.
        """
        return page.write(self.kept, Path(path))

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
        names = " and ".join(record.controller for record in self.records)
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
    record = run_episode(episode, Audience(onlooker=recorder))
    if record.status != "ok":
        raise TrajectoryError(
            f"{record.controller} on {record.scenario}, seed {record.seed}: nothing to show, "
            f"{record.status}: {record.reason}"
        )
    return recorder.trajectories(record)

"""Films of replays: as long as their range, or refused."""

from pathlib import Path

import pytest
from factories.episodes import WITH_LIGHTS
from PIL import Image

from benchmark.pictures.replay import film
from benchmark.pictures.replay.replay import Replay, recorded
from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.plumbing.errors import TrajectoryError, UsageError


def test_a_gif_has_the_pictures_of_its_range(kept: Trajectories, tmp_path: Path) -> None:
    path = Replay([kept]).film(tmp_path / "a.gif", begin=40.0, end=48.0, speed=4.0)
    with Image.open(path) as found:
        assert (found.n_frames, found.size) == (25, film.SIZES[".gif"])
        assert len(found.convert("RGB").getcolors(2**24)) > 10


def test_an_mp4_lasts_as_long_as_its_range(kept: Trajectories, tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    shown = Replay([kept, recorded(WITH_LIGHTS)])
    path = shown.film(tmp_path / "a.mp4", begin=40.0, end=44.0, speed=4.0)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert (count, seconds) == (30, pytest.approx(1.0, abs=0.05))


def test_a_film_that_is_too_long_or_cannot_be_written_is_refused(
    kept: Trajectories, tmp_path: Path
) -> None:
    shown = Replay([kept])
    with pytest.raises(TrajectoryError, match="holds 60 s at most"):
        shown.film(tmp_path / "a.gif", begin=0.0, end=120.0, speed=1.0)
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot write"):
        shown.film(tmp_path / "file" / "a.gif", begin=40.0, end=41.0)
    assert [one.name for one in tmp_path.iterdir()] == ["file"]

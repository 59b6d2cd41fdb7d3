"""Episodes -> the pictures of a film -> GIF or MP4."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.plumbing import files
from benchmark.plumbing.errors import TrajectoryError, UsageError

KINDS = (".gif", ".mp4")
SPEED = 4.0  # seconds of the episode in one of the film
LONGEST = {".gif": 60.0, ".mp4": 600.0}  # s; a longer GIF fills the memory of who opens it
RATES = {".gif": 12.5, ".mp4": 30.0}  # pictures per second
SIZES = {".gif": (800, 450), ".mp4": (1280, 720)}
BAR, GAP = 0.075, 6  # of the height, for words; pixels between two episodes
DOTS = 72  # per inch: a point is a pixel


@dataclass(frozen=True)
class Range:
    """The part of an episode that a film shows."""

    begin: float  # s
    end: float  # s
    speed: float = SPEED

    @classmethod
    def of(
        cls, kept: Trajectories, begin: float | None, end: float | None, speed: float = SPEED
    ) -> "Range":
        """A range within an episode; by default the first minute that counts.

        Raises:
            TrajectoryError: there is nothing of the episode in it.
        """
        first, last = kept.start, kept.start + (kept.steps - 1) * kept.step
        begin = min(kept.warm_up, last - kept.step) if begin is None else begin
        end = min(begin + 60.0, last) if end is None else end
        begin, end = max(begin, first), min(end, last)
        if not begin < end:
            raise TrajectoryError(
                f"nothing to film from {begin:g} s to {end:g} s; the episode lasts from "
                f"{first:g} s to {last:g} s, choose a part of it with --from and --to"
            )
        return cls(begin, end, speed)

    @property
    def length(self) -> float:
        """Of the film [s]."""
        return (self.end - self.begin) / self.speed

    def moments(self, rate: float) -> list[float]:
        """The time in the episode of each picture [s]."""
        count = max(1, math.floor(self.length * rate + 1e-9))
        return [self.begin + index * self.speed / rate for index in range(count)]


def check_kind(path: Path) -> str:
    """The kind of film that a file's name asks for.

    Raises:
        UsageError: none that can be made, or what makes it is not installed.
    """
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise UsageError(f"{path}: films are {' or '.join(KINDS)}; give one of these endings")
    if kind == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError as error:
            raise UsageError(
                f"{path}: MP4 needs ffmpeg; pip install 'rightofway[video]', or make a GIF"
            ) from error
    return kind


def write(kept: Sequence[Trajectories], path: Path, part: Range) -> None:
    """Write a film of one episode, or of several side by side, whole or not at all.

    Args:
        kept: what to show; of the same traffic.
        path: where, ending in ``.gif`` or ``.mp4``.
        part: what part of it.

    Raises:
        TrajectoryError: the film would be too long.
        UsageError: the file cannot be written, or its ending is none of a film.
    """
    from benchmark.pictures.sheet.sheet import styled

    kind = check_kind(path)
    if part.length > LONGEST[kind]:
        raise TrajectoryError(
            f"{path}: {part.length:.0f} s of film; {kind} holds {LONGEST[kind]:.0f} s at most: "
            "show less with --from and --to, or faster with --speed"
        )
    pictures = _pictures(kept, part.moments(RATES[kind]), SIZES[kind])
    write_kind = _write_gif if kind == ".gif" else _write_mp4
    with files.writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with files.replaced(path) as draft, styled():
            write_kind(pictures, draft)


def _pictures(
    kept: Sequence[Trajectories], moments: Sequence[float], size: tuple[int, int]
) -> Iterator[bytes]:
    """The pictures of a film as RGBA, episodes side by side."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from benchmark.pictures.replay.stage import FIELD, Stage

    width, height = size
    figure = Figure(figsize=(width / DOTS, height / DOTS), dpi=DOTS, facecolor=FIELD)
    canvas: Any = FigureCanvasAgg(figure)
    share = (width - GAP * (len(kept) - 1)) / len(kept)
    stages = [
        Stage(
            figure.add_axes((order * (share + GAP) / width, 0.0, share / width, 1 - BAR)),
            episode,
            bar=BAR * height,
        )
        for order, episode in enumerate(kept)
    ]
    canvas.draw()
    ground = canvas.copy_from_bbox(figure.bbox)
    for time in moments:
        canvas.restore_region(ground)
        for stage in stages:
            stage.show(time)
        yield bytes(canvas.buffer_rgba())


def _write_gif(pictures: Iterator[bytes], path: Path) -> None:
    """All pictures with the colours of the first and of what may come, so that nothing flickers."""
    from PIL import Image

    from benchmark.pictures.replay.stage import swatches

    size = SIZES[".gif"]
    images = (Image.frombytes("RGBA", size, picture).convert("RGB") for picture in pictures)
    first = next(images)
    coloured = first.copy()
    coloured.paste(Image.fromarray(swatches()).resize((size[0], 30), Image.Resampling.NEAREST))
    palette = coloured.quantize(128, method=Image.Quantize.MEDIANCUT)
    frames = (
        image.quantize(palette=palette, dither=Image.Dither.NONE)
        for image in chain([first], images)
    )
    next(frames).save(
        path,
        save_all=True,
        append_images=frames,
        duration=round(1000 / RATES[".gif"]),
        loop=0,
        optimize=False,
    )


def _write_mp4(pictures: Iterator[bytes], path: Path) -> None:
    """H.264 that slides and browsers play."""
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(path),
        SIZES[".mp4"],
        pix_fmt_in="rgba",
        fps=RATES[".mp4"],
        codec="libx264",
        quality=7,
        macro_block_size=2,
        ffmpeg_log_level="error",
        output_params=["-movflags", "+faststart"],
    )
    try:
        writer.send(None)
        for picture in pictures:
            writer.send(picture)
    finally:
        writer.close()

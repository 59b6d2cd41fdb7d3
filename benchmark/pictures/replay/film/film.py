"""Episodes -> the pictures of a film -> GIF or MP4."""

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.pictures.replay.film import signs
from benchmark.pictures.replay.film.scene import ASPHALT, CRASH, FIELD, HV, RV, Scene
from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.plumbing.errors import TrajectoryError, UsageError
from benchmark.records.record import Record
from benchmark.reports.tables import percent

if TYPE_CHECKING:
    from PIL.Image import Image

KINDS = (".gif", ".mp4")
SPEED = 4.0  # seconds of the episode in one of the film
LONGEST = {".gif": 60.0, ".mp4": 600.0}  # s; a longer GIF fills the memory of who opens it
RATES = {".gif": 12.5, ".mp4": 30.0}  # pictures per second
SIZES = {".gif": (800, 450), ".mp4": (1280, 720)}
BAR, GAP = 0.075, 6  # of the height, for words; pixels between two episodes
INK, QUIET = (236, 235, 230), (162, 171, 173)


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
    kind = check_kind(path)
    if part.length > LONGEST[kind]:
        raise TrajectoryError(
            f"{path}: {part.length:.0f} s of film; {kind} holds {LONGEST[kind]:.0f} s at most: "
            "show less with --from and --to, or faster with --speed"
        )
    pictures = _pictures(kept, part.moments(RATES[kind]), SIZES[kind])
    beside = path.with_name(f"{path.stem}.{os.getpid()}{kind}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        (_write_gif if kind == ".gif" else _write_mp4)(pictures, beside)
        beside.replace(path)
    except OSError as error:
        raise UsageError(
            f"{path}: cannot write: {error.strerror or error}; choose another file"
        ) from error
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def _pictures(
    kept: Sequence[Trajectories], moments: Sequence[float], size: tuple[int, int]
) -> Iterator["Image"]:
    """The pictures of a film: words above each episode, episodes side by side."""
    from PIL import Image, ImageDraw, ImageFont

    width, height = size
    bar = round(BAR * height)
    across = (width - GAP * (len(kept) - 1)) // len(kept)
    scenes = [Scene(one, (across, height - bar)) for one in kept]
    font = ImageFont.load_default(size=round(bar * 0.5))
    for time in moments:
        image = Image.new("RGB", size, FIELD)
        draw = ImageDraw.Draw(image)
        for order, scene in enumerate(scenes):
            one, left = scene.kept, order * (across + GAP)
            step = min((time - one.start) / one.step, one.steps - 1.0)
            image.paste(scene.picture(max(step, 0.0)), (left, bar))
            draw.rectangle((left, 0, left + across - 1, bar - 1), fill=FIELD)
            words, figures = _words(one.record), _figures(one, step, time)
            room = across - 2 * GAP - font.getlength(f"  {figures}")
            while words and font.getlength(words) > room:
                words = words[:-1]
            middle = bar / 2
            draw.text((left + GAP, middle), words, fill=INK, font=font, anchor="lm")
            draw.text((left + across - GAP, middle), figures, fill=QUIET, font=font, anchor="rm")
        yield image


def _words(record: Record) -> str:
    rate = "" if record.rate is None else f", {percent(record.rate)} RVs"
    return f"{record.controller}{rate}"


def _figures(kept: Trajectories, step: float, time: float) -> str:
    waiting = float(kept.curves[0].waiting[int(step)])
    return f"{'no one waits' if math.isnan(waiting) else f'waiting {waiting:.1f} s'}  {time:.0f} s"


def _write_gif(pictures: Iterator["Image"], path: Path) -> None:
    """All pictures with the colours of the first and of what may come, so that nothing flickers."""
    from PIL.Image import Dither, Quantize

    first = next(pictures)
    palette = _with_swatches(first).quantize(128, method=Quantize.MEDIANCUT)
    few = (one.quantize(palette=palette, dither=Dither.NONE) for one in chain([first], pictures))
    next(few).save(
        path,
        save_all=True,
        append_images=few,
        duration=round(1000 / RATES[".gif"]),
        loop=0,
        optimize=False,
    )


def _with_swatches(image: "Image") -> "Image":
    """A picture with a patch of every colour of its own, so that the palette has them."""
    from PIL import ImageDraw

    colours = [RV, HV, CRASH, ASPHALT, INK, *signs.RINGS.values(), *signs.LIGHTS.values()]
    copy = image.copy()
    draw = ImageDraw.Draw(copy)
    side = image.width // len(colours)
    for order, colour in enumerate(colours):
        draw.rectangle((order * side, 0, (order + 1) * side, side), fill=colour)
    return copy


def _write_mp4(pictures: Iterator["Image"], path: Path) -> None:
    """H.264 that slides and browsers play."""
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(path),
        SIZES[".mp4"],
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
            writer.send(picture.tobytes())
    finally:
        writer.close()

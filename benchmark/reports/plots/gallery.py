"""All figures: their names, captions, and the page that holds them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from benchmark.plumbing.files import writing
from benchmark.records.leaderboard import REFERENCE
from benchmark.reports.plots import comparison, style, traffic, training, waiting
from benchmark.reports.plots.data import Data
from benchmark.reports.words import percent


@dataclass(frozen=True)
class Kind:
    """A figure that can be drawn."""

    name: str  # of its file
    caption: str
    lacks: str  # what to do where there is nothing to draw
    draw: Callable[[Data, dict[str, Path]], Figure | None]


RUN = "run controllers that command vehicles, beside `traffic-light`"
KINDS = (
    Kind(
        "waiting",
        "Average waiting time by RV penetration rate. Boxes: quartiles over seeds with the median, "
        "whiskers to 1.5 times their height, dots beyond. Lines: means of the signals.",
        RUN,
        lambda data, _: waiting.boxes(data),
    ),
    Kind(
        "improvement",
        f"Reduction of average waiting time against `{REFERENCE}` in per cent, paired by seed; ?: "
        "the 95 % bootstrap interval holds zero, or there are fewer than six seeds.",
        RUN,
        lambda data, _: comparison.improvement(data),
    ),
    Kind(
        "crossover",
        f"The penetration rate from which average waiting time stays below that of `{REFERENCE}`: "
        "where the mean paired difference, taken to change in a straight line between the rates "
        "that ran, passes zero for the last time. Bars: 95 % bootstrap intervals over seeds.",
        f"{RUN}, at two rates or more",
        lambda data, _: comparison.crossover_figure(data),
    ),
    Kind(
        "throughput",
        "Average waiting time against throughput, means over seeds; lines go along the penetration "
        "rates to the highest, which is marked larger. Below and to the right is better.",
        RUN,
        lambda data, _: waiting.throughput(data),
    ),
    Kind(
        "unregulated",
        "Share of unregulated lanes, those with no RV in the control zone, over time: means over "
        "seeds with 95 % bootstrap intervals.",
        "run at this rate, or give another with --at",
        lambda data, _: traffic.unregulated(data),
    ),
    Kind(
        "movements",
        "Waiting of the vehicles of each movement, under the signal too: means over seeds with "
        "95 % bootstrap intervals.",
        "run at this rate, or give another with --at",
        lambda data, _: traffic.movements(data),
    ),
    Kind(
        "training",
        "What each training run logged, round by round.",
        "give the folders of training runs with --training",
        lambda _, logs: training.training_curves(logs),
    ),
)
NAMES = tuple(kind.name for kind in KINDS)
PAGE = "README.md"


def write_figures(
    data: Data, logs: dict[str, Path], folder: Path, form: style.Format, only: Sequence[str]
) -> Iterator[tuple[Kind, Path | None]]:
    """Draw figures one by one; None stands for a file where there is nothing to draw.

    Args:
        data: what to draw.
        logs: of training runs, by name.
        folder: where they go, each to a file of its name.
        form: their format.
        only: the names of those that are wanted; empty for all.
    """
    for kind in KINDS:
        if only and kind.name not in only:
            continue
        target = folder / f"{kind.name}.{form}"
        with style.styled():
            figure = kind.draw(data, logs)
            if figure is not None:
                style.save(figure, target)
        yield kind, target if figure is not None else None


def write_gallery(data: Data, written: Sequence[tuple[Kind, Path]], folder: Path) -> None:
    """Write the page that shows the figures with their captions.

    Raises:
        UsageError: it cannot be written.
    """
    lines = ["# Figures", ""]
    for kind, path in written:
        lines += [f"## {kind.name.capitalize()}", "", f"![{_plain(kind.caption)}]({path.name})", ""]
        lines += [_placed(kind, data), ""]
    with writing(folder / PAGE, remedy="choose another folder with --out"):
        (folder / PAGE).write_text("\n".join(lines), encoding="utf-8")


def _placed(kind: Kind, data: Data) -> str:
    """A caption with the rate, where a figure is of one."""
    at_one = kind.name in ("unregulated", "movements")
    return f"{kind.caption} At {percent(data.rate)} RVs." if at_one else kind.caption


def _plain(caption: str) -> str:
    return caption.replace("`", "").replace("[", "(").replace("]", ")")

"""The paper's two figures of results: box plots of waiting, and unregulated lanes over time."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from baselines.paper.published import FIGURE_RATE, METHODS, RATES, SIGNAL, WANG
from baselines.paper.report import UNREGULATED, WAITING
from baselines.paper.samples import Samples
from benchmark.plumbing.errors import UsageError
from benchmark.records import table
from benchmark.records.record import Record
from benchmark.reports.plots import style, traffic, waiting
from benchmark.reports.plots.data import Data, Wish

SHOWN = (WANG, *METHODS)


def write(samples: Samples, folder: Path) -> tuple[str, ...]:
    """Draw what there are records for; the same records give the same bytes.

    Returns:
        The names of the files in the folder. Those of figures that there are no records for are
        gone from there.

    Raises:
        UsageError: a file cannot be written.
    """
    written = []
    with style.styled():
        for name, figure in drawn(samples).items():
            if figure is not None:
                style.save(figure, folder / name)
                written.append(name)
            else:
                _remove(folder / name)
    return tuple(written)


def _remove(target: Path) -> None:
    try:
        target.unlink(missing_ok=True)
    except OSError as error:
        raise UsageError(f"{target}: cannot remove: {error.strerror}; use another --out") from error


def drawn(samples: Samples) -> dict[str, Figure | None]:
    """Each figure by the name of its file; None without anything to show."""
    records = [*samples.records((*SHOWN, SIGNAL))]
    there = {record.controller for record in records}
    if not there.intersection(SHOWN):
        return {WAITING: None, UNREGULATED: None}

    def read(_: Sequence[str]) -> list[Record]:
        return records

    controllers = [name for name in SHOWN if name in there]
    wish = Wish(controllers=controllers, rates=RATES, rate=FIGURE_RATE)
    data = Data(table.of(records), read, wish)
    return {WAITING: waiting.boxes(data), UNREGULATED: traffic.unregulated(data)}

"""The paper's two figures of results: box plots of waiting, and unregulated lanes over time."""

from pathlib import Path

from matplotlib.figure import Figure

from baselines.paper.published import FIGURE_RATE, METHODS, RATES, SIGNAL, WANG
from baselines.paper.report import UNREGULATED, WAITING
from baselines.paper.samples import Samples
from benchmark.plumbing.files import writing
from benchmark.reports.plots import style, traffic, waiting
from benchmark.reports.plots.data import Wish

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
                with writing(folder / name, remedy="use another --out"):
                    (folder / name).unlink(missing_ok=True)
    return tuple(written)


def drawn(samples: Samples) -> dict[str, Figure | None]:
    """Each figure by the name of its file; None without anything to show."""
    controllers = [name for name in SHOWN if name in samples.controllers]
    if not controllers:
        return {WAITING: None, UNREGULATED: None}
    wish = Wish(controllers=controllers, rates=RATES, rate=FIGURE_RATE)
    data = samples.data((*SHOWN, SIGNAL), wish)
    return {WAITING: waiting.boxes(data), UNREGULATED: traffic.unregulated(data)}

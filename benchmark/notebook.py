"""Scenarios, leaderboards, replays and figures in a notebook: ``%load_ext benchmark.notebook``."""

import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmark.pictures.replay.replay import Replay as Replay
from benchmark.pictures.sheet import whole
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.messages import nearest
from benchmark.records import leaderboard
from benchmark.records.leaderboard import Row
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.reports import tables
from benchmark.scenario.scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESOLUTION = 110  # dots per inch


class Leaderboard:
    """The leaderboard of records; a notebook shows a table of waiting for each rate.

    Args:
        rows: as ``benchmark.records.leaderboard.rows_of`` gives them.
    """

    def __init__(self, rows: Sequence[Row]) -> None:
        self.rows = tuple(rows)

    @classmethod
    def of(cls, records: Iterable[Record]) -> "Leaderboard":
        """That of some records."""
        return cls(leaderboard.rows_of_records(records))

    @classmethod
    def read(cls, results: Path | str) -> "Leaderboard":
        """That of a results folder.

        Raises:
            StoreError: the folder holds no records, or a line is not a record.
        """
        return cls(leaderboard.rows_of(Store(Path(results)).table()))

    @property
    def rates(self) -> list[float]:
        """The penetration rates that were run, rising."""
        return sorted({row.rate for row in self.rows if row.rate is not None})

    def __repr__(self) -> str:
        scenarios = len({row.scenario for row in self.rows})
        controllers = len({row.controller for row in self.rows})
        return f"Leaderboard({controllers} controllers on {scenarios} scenarios)"

    def _repr_markdown_(self) -> str:
        parts = [tables.table_at_rate(self.rows, rate) for rate in self.rates]
        return "\n".join(parts) or tables.leaderboard_markdown(self.rows)

    def _repr_html_(self) -> str:
        from markdown_it import MarkdownIt

        words = MarkdownIt("commonmark", {"html": False}).enable("table")
        return str(words.render(self._repr_markdown_()))


def figure(name: str, results: Path | str = "out") -> "Figure | None":
    """A figure of a results folder, as ``rightofway figures --only NAME`` draws it.

    Args:
        name: such as ``"waiting"``.
        results: the folder.

    Returns:
        The figure; None where the records hold nothing to draw.

    Raises:
        UsageError: there is no such figure.
        StoreError: the folder holds no records.
    """
    from benchmark.reports.plots import gallery, style
    from benchmark.reports.plots.data import Data, Wish

    kind = next((kind for kind in gallery.KINDS if kind.name == name), None)
    if kind is None:
        raise UsageError(f'no figure "{name}"{nearest(name, gallery.NAMES)}')
    store = Store(Path(results))
    with style.styled():
        return kind.draw(Data(store.table(), store.records_of, Wish()), {})


def load_ipython_extension(shell: Any) -> None:
    """Let IPython show scenarios as drawings, and the figures of plots as pictures."""
    from matplotlib.figure import Figure

    formatters = shell.display_formatter.formatters
    formatters["image/svg+xml"].for_type(Scenario, plan)
    formatters["image/png"].for_type(Figure, picture)


def plan(scenario: Scenario) -> str:
    """A scenario from above, as SVG."""
    return whole.panels(scenario)["plan"]


def picture(figure: "Figure") -> bytes:
    """A figure as PNG."""
    from benchmark.reports.plots import style

    with style.styled(), io.BytesIO() as file:
        figure.savefig(file, format="png", dpi=RESOLUTION, metadata={"Software": None})
        return file.getvalue()

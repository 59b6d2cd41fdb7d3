"""The notebook in docs runs from its first cell to its last, and shows what it promises."""

import asyncio
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from types import ModuleType
from typing import Any

import nbformat
import pytest
from factories.processes import PATIENCE
from factories.records import record
from factories.scenarios import ROOT
from IPython.core.interactiveshell import InteractiveShell
from nbclient import NotebookClient
from traitlets.config import Config

from benchmark.notebook import Leaderboard

TOUR = nbformat.read(ROOT / "docs" / "tour.ipynb", as_version=4)
KINDS = [
    {"image/svg+xml"},
    set(),
    {"text/html", "text/markdown"},
    set(),
    {"text/html"},
    {"image/png"},
    set(),
]
"""Of what each cell with code shows, besides text."""


@pytest.fixture
def shell(here: Path) -> Iterator[InteractiveShell]:
    """What a kernel hands its cells to."""
    config = Config({"HistoryManager": {"enabled": False}})
    module = ModuleType("tour")
    yield InteractiveShell.instance(config=config, user_module=module, ipython_dir=str(here))
    InteractiveShell.clear_instance()


def test_the_tour_has_ten_cells_and_is_kept_small() -> None:
    assert len(TOUR.cells) == 10
    assert not any(cell.get("outputs") for cell in TOUR.cells)  # run it to see them


@pytest.mark.usefixtures("without_workers")
def test_every_cell_of_the_tour_shows_what_it_promises(shell: InteractiveShell) -> None:
    shown = []
    for cell in TOUR.cells:
        if cell.cell_type == "code":
            done = shell.run_cell(cell.source)
            done.raise_error()
            shown.append(set(shell.display_formatter.format(done.result)[0]))
    assert [kinds - {"text/plain"} for kinds in shown] == KINDS


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_tour_runs_in_a_kernel(here: Path) -> None:
    tour = deepcopy(TOUR)
    client = NotebookClient(
        tour,
        timeout=PATIENCE,
        resources={"metadata": {"path": str(here)}},
        kernel_name="python3",
    )
    loop = asyncio.new_event_loop()
    loop.run_until_complete(client.async_execute())
    loop.close()
    shown = [_kinds(cell) for cell in tour.cells if cell.cell_type == "code"]
    assert [kinds - {"text/plain"} for kinds in shown] == KINDS


def _kinds(cell: Any) -> set[str]:
    assert not [one for one in cell.outputs if one.output_type == "error"]
    return {kind for one in cell.outputs for kind in one.get("data", {})}


def test_a_leaderboard_is_a_table_in_which_text_is_text() -> None:
    evil = "<script>alert(1)</script>"
    board = Leaderboard.of([record(evil), record(evil, rate=0.7), record("b", 2)])
    assert repr(board) == "Leaderboard(2 controllers on 1 scenarios)"
    html = board._repr_html_()
    assert html.count("<table>") == 2
    assert "<script" not in html
    assert board.rates == [0.5, 0.7]


def test_a_leaderboard_without_rates_or_rows_is_shown_too() -> None:
    signals = Leaderboard.of([record("traffic-light", rate=None)])
    assert "traffic-light" in signals._repr_html_()
    assert Leaderboard.of([])._repr_html_() is not None

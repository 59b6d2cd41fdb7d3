"""The notebook in docs runs from its first cell to its last, and shows what it promises."""

import asyncio
from pathlib import Path
from typing import Any

import nbformat
import pytest
from factories.processes import PATIENCE
from factories.records import record
from factories.scenarios import ROOT
from nbclient import NotebookClient

from benchmark.notebook import Leaderboard

TOUR = ROOT / "docs" / "tour.ipynb"


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_tour_runs_in_ten_cells_and_shows_everything(tmp_path: Path) -> None:
    tour = nbformat.read(TOUR, as_version=4)
    assert len(tour.cells) == 10
    assert not any(cell.get("outputs") for cell in tour.cells)  # kept small: run it to see them
    client = NotebookClient(
        tour,
        timeout=PATIENCE,
        resources={"metadata": {"path": str(tmp_path)}},
        kernel_name="python3",
    )
    loop = asyncio.new_event_loop()
    loop.run_until_complete(client.async_execute())
    loop.close()
    shown = [_kinds(cell) for cell in tour.cells if cell.cell_type == "code"]
    assert [sorted(kinds - {"text/plain"}) for kinds in shown] == [
        ["image/svg+xml"],
        [],
        ["text/html", "text/markdown"],
        [],
        ["text/html"],
        ["image/png"],
        [],
    ]


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

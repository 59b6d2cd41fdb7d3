"""Waiting by movement, of signals too."""

from pathlib import Path

from factories.command_line import rightofway
from factories.records import SIGNAL, filled, record, study

from benchmark.records.movements import movement_rows
from benchmark.records.record import Waiting
from benchmark.records.table import records_table


def test_a_row_has_the_mean_over_seeds_of_each_movement() -> None:
    records = study(a=[30.0, 10.0])
    rows = movement_rows(records_table(records), records)
    assert [(row.rate, row.controller) for row in rows] == [
        (rate, name) for rate in (0.1, 0.2) for name in ("a", SIGNAL)
    ]
    assert rows[0].waiting["N-C"].mean == 30.0
    assert rows[0].waiting["N-C"].count == 7
    assert rows[1].waiting == {}


def test_the_command_shows_movements_of_signals_beside_controllers(tmp_path: Path) -> None:
    waits = {"N-C": Waiting(mean=12.0, p95=1, maximum=1, vehicles=2)}
    light = record(SIGNAL, rate=None, waiting_by_movement=waits)
    ours = {"E-L": Waiting(mean=3.0, p95=1, maximum=1, vehicles=2)}
    filled(tmp_path, light, record("c", rate=0.5, waiting_by_movement=ours))
    shown = rightofway(tmp_path, "leaderboard", "--records", ".", "--movements").stdout
    assert "## test/a at 50 %" in shown
    assert ["c", "3.0", "-"] in [
        [cell.strip() for cell in line.strip("|").split("|")] for line in shown.splitlines()
    ]
    assert "12.0" in shown
    refused = rightofway(
        tmp_path, "leaderboard", "--records", ".", "--movements", "--format", "csv"
    )
    assert refused.returncode == 2
    assert "--movements makes Markdown tables" in refused.stderr

"""Charts whose lines can be told apart."""

from benchmark.records.leaderboard import REFERENCE
from benchmark.reports.site import charts


def test_lines_of_a_chart_look_different() -> None:
    looks = charts.line_looks([*(f"c{index}" for index in range(40)), REFERENCE])
    assert len({(line.colour, line.dash) for line in looks}) == 41
    assert [line.name for line in looks if line.shown] == [REFERENCE, *(f"c{i}" for i in range(6))]

"""A row of a regression check in words, the same in every report."""

from collections.abc import Sequence

from benchmark.records.regression import Comparison, Row
from benchmark.records.statistics import Estimate
from benchmark.reports.tables import percent

HEAD = (
    *("verdict", "scenario", "controller", "rate", "figure"),
    *("before", "now", "ratio", "difference", "seeds"),
)
RIGHT = HEAD[5:]  # columns that are aligned to the right


def cells(row: Row) -> list[str]:
    """The row's texts in the order of ``HEAD``."""
    return [
        *(str(row.verdict), row.scenario, row.controller, rate(row), figure(row)),
        *(number(row.reference, row), number(row.new, row), ratio(row), difference(row)),
        str(row.seeds),
    ]


def rate(row: Row) -> str:
    """The penetration rate; a controller that commands no vehicle stands at every one."""
    return "every" if row.rate is None else percent(row.rate)


def figure(row: Row) -> str:
    """The figure with its unit."""
    column = row.column
    return f"{column.title} [{column.unit}]" if column.unit else column.title


def number(value: float | None, row: Row) -> str:
    """A mean, one digit finer than on the leaderboard."""
    return "-" if value is None else f"{value:.{row.column.digits + 1}f}"


def ratio(row: Row) -> str:
    """New over reference."""
    return "-" if row.ratio is None else f"{row.ratio:.3f}"


def difference(row: Row) -> str:
    """The mean difference with its interval, as in ``+1.20 [+0.91, +1.42]``."""
    return "-" if row.difference is None else _signed(row.difference, row.column.digits + 1)


def _signed(estimate: Estimate, digits: int) -> str:
    mean = f"{estimate.mean:+.{digits}f}"
    if estimate.low is None:
        return mean
    return f"{mean} [{estimate.low:+.{digits}f}, {estimate.high:+.{digits}f}]"


def headline(comparison: Comparison) -> str:
    """The outcome in one sentence."""
    counts = ", ".join(f"{count} {verdict}" for verdict, count in comparison.counts().items())
    outcome = {0: "No regression", 1: "Regression", 2: "Nothing to compare"}
    return (
        f"{outcome[comparison.exit_code]} at a limit of {100 * comparison.limit:g} %: "
        f"{counts or 'no rows'}."
    )


def remarks(rows: Sequence[Row]) -> list[str]:
    """Remarks, each once and in one line, with the rows that they are of."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        if row.remark:
            found.setdefault(row.remark, []).append(row)
    return [one_line(f"{_who(members)}: {remark}") for remark, members in found.items()]


def one_line(text: str) -> str:
    """Text without line breaks and what steers terminals; controllers' errors may hold any."""
    line = " ".join(text.split())
    return "".join(sign if sign.isprintable() else "?" for sign in line)


def _who(rows: Sequence[Row]) -> str:
    places = list(dict.fromkeys(f"{row.scenario} {row.controller} {rate(row)}" for row in rows))
    return f"{places[0]}{f' and {len(places) - 1} more' if len(places) > 1 else ''}"

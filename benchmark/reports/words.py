"""Words that tables, plots and pages share."""

from benchmark.records.statistics import Estimate


def percent(rate: float | None) -> str:
    """A penetration rate for people."""
    return "no RVs" if rate is None else f"{100 * rate:g} %"


def mean_and_interval(estimate: Estimate | None, digits: int) -> str:
    """A mean with its interval, as in ``12.3 [11.0, 13.6]``; a dash where there is none."""
    if estimate is None:
        return "-"
    if estimate.low is None:
        return f"{estimate.mean:.{digits}f}"
    return f"{estimate.mean:.{digits}f} [{estimate.low:.{digits}f}, {estimate.high:.{digits}f}]"


def markdown_literal(text: str) -> str:
    """Text as Markdown shows it literally."""
    return "".join(f"\\{sign}" if sign in "\\`*_{}[]<>#|&~" else sign for sign in text)

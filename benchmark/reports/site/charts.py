"""Interactive charts in Vega-Lite: a figure with its interval against the penetration rate."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from benchmark.records.leaderboard import REFERENCE
from benchmark.records.statistics import Estimate
from benchmark.reports.words import mean_and_interval, percent

COLOURS = (
    *("#3b7dd8", "#d9731a", "#2f9e5b", "#c94f7c", "#8a63d2"),
    *("#0e9aa7", "#b8860b", "#d1495b", "#6b8e23", "#7f7f8c"),
)  # each with a contrast above 3 on light and on dark ground
DASHES: tuple[tuple[int, ...], ...] = ((1, 0), (6, 3), (2, 2), (9, 3, 2, 3))
REFERENCE_COLOUR, REFERENCE_DASH = "#808890", (5, 4)
SHOWN = 6  # lines that a chart starts with
HEIGHT = 340  # px
SNIPPET = "window.vegaEmbed = vegaEmbed;"


@dataclass(frozen=True)
class Line:
    """How a series is drawn."""

    name: str
    colour: str
    dash: tuple[int, ...]
    shown: bool  # when the page opens


@dataclass(frozen=True)
class Chart:
    """What a page needs to draw a chart and to say what it shows."""

    title: str
    words: str  # for those who do not see it
    lines: Sequence[Line]
    points: Sequence[Mapping[str, Any]]
    spec: Mapping[str, Any] = field(repr=False)

    @property
    def document(self) -> dict[str, Any]:
        """What the script reads."""
        return {"spec": self.spec, "points": self.points}


def line_looks(names: Sequence[str], shown: int = SHOWN) -> list[Line]:
    """A look for each series; the signal's is apart.

    Args:
        names: of the series, in the order that matters.
        shown: how many of them there are when the page opens, besides the signal.
    """
    others = [name for name in names if name != REFERENCE]
    looks = [Line(REFERENCE, REFERENCE_COLOUR, REFERENCE_DASH, True)] if REFERENCE in names else []
    for index, name in enumerate(others):
        colour = COLOURS[index % len(COLOURS)]
        dash = DASHES[index // len(COLOURS) % len(DASHES)]
        looks.append(Line(name, colour, dash, index < shown))
    return looks


def by_rate(
    title: str,
    words: str,
    looks: Sequence[Line],
    figures: Mapping[tuple[str, float], Estimate],
    *,
    axis: str,
    zero_line: bool = False,
) -> Chart | None:
    """Means with their intervals by rate, a line per series; None without a figure.

    Args:
        title: above the chart.
        words: what it shows, for those who do not see it.
        looks: of the series, in the order of the legend.
        figures: by series and rate.
        axis: the title of the vertical axis.
        zero_line: whether zero is a mark that matters, as with differences.
    """
    if not figures:
        return None
    points = [_point(series, rate, estimate) for (series, rate), estimate in figures.items()]
    return Chart(title, words, looks, points, _titled(_spec(tuple(looks), zero_line), axis))


def _point(series: str, rate: float, estimate: Estimate) -> dict[str, Any]:
    low, high = estimate.bounds
    return {
        "series": series,
        "rate": rate,
        "mean": round(estimate.mean, 4),
        "low": round(low, 4),
        "high": round(high, 4),
        "words": f"{mean_and_interval(estimate, 1)} s",
        "seeds": estimate.count,
        "at": percent(rate),
    }


def _titled(spec: dict[str, Any], axis: str) -> dict[str, Any]:
    titled = deepcopy(spec)
    for layer in titled["layer"]:
        layer["encoding"]["y"]["title"] = axis
    return titled


@lru_cache  # charts of the same lines differ in little, and each takes Altair long to check
def _spec(looks: tuple[Line, ...], zero_line: bool) -> dict[str, Any]:
    import altair as alt

    names = [look.name for look in looks]
    colour = alt.Scale(domain=names, range=[look.colour for look in looks])
    dash = alt.Scale(domain=names, range=[list(look.dash) for look in looks])
    base = alt.Chart(alt.NamedData("points")).encode(
        x=alt.X("rate:Q", title="penetration rate", axis=alt.Axis(format=".0%", tickMinStep=0.1)),
        color=alt.Color("series:N", legend=None, scale=colour),
    )
    band = base.mark_area(opacity=0.16).encode(y="low:Q", y2="high:Q")
    line = base.mark_line(strokeWidth=2).encode(
        y="mean:Q", strokeDash=alt.StrokeDash("series:N", legend=None, scale=dash)
    )
    dots = base.mark_point(filled=True, size=55, opacity=1).encode(
        y="mean:Q",
        tooltip=[
            alt.Tooltip("series:N", title="series"),
            alt.Tooltip("at:N", title="RVs"),
            alt.Tooltip("words:N", title="mean [95 %]"),
            alt.Tooltip("seeds:Q", title="seeds"),
        ],
    )
    layers = [band, line, dots]
    if zero_line:
        zero = alt.Chart(alt.InlineData([{"zero": 0}])).mark_rule(strokeWidth=1)
        layers.insert(0, zero.encode(y="zero:Q"))
    chart = alt.layer(*layers).properties(width="container", height=HEIGHT)
    document: dict[str, Any] = chart.configure(aria=False).to_dict()
    return document


@lru_cache
def vega_script() -> str:
    """Vega, Vega-Lite and Vega-Embed as one script that sets ``window.vegaEmbed``."""
    import altair as alt
    import vl_convert

    version = ".".join(alt.SCHEMA_VERSION.removeprefix("v").split(".")[:2])
    return f"(() => {{\n{vl_convert.javascript_bundle(SNIPPET, vl_version=version)}\n}})();\n"

"""The templates' environment: everything escaped, unknown names refused, figures as people read."""

from typing import TYPE_CHECKING

from markupsafe import Markup, escape

from benchmark import __version__
from benchmark.records.leaderboard import Row
from benchmark.records.measures import Measure
from benchmark.records.statistics import Estimate
from benchmark.reports import web
from benchmark.reports.site.contents import Contents, rates
from benchmark.reports.site.methods import mathml
from benchmark.reports.words import percent

if TYPE_CHECKING:
    from jinja2 import Environment

DASH, MINUS = "\N{EN DASH}", "\N{MINUS SIGN}"
NONE = Markup('<span class="none">{}</span>').format(DASH)


def site_environment(contents: Contents) -> "Environment":
    """The environment of one site's templates."""
    made = web.environment("benchmark.reports.site")
    made.filters |= {
        "percent": percent,
        "rates": rates,
        "rate": rate_key,
        "estimate": estimate,
        "plain": plain,
        "verdict": verdict,
        "short": lambda text: text[:12],
        "unit": unit,
        "mathml": mathml,
    }
    made.globals |= {"contents": contents, "links": contents.addresses, "version": __version__}
    return made


def rate_key(rate: float | None) -> str:
    """A rate as filters and addresses have it."""
    return "none" if rate is None else f"{rate:g}"


def unit(measure: Measure) -> Markup:
    """A measure's unit as it stands behind its title."""
    return Markup(" <small>[{}]</small>").format(measure.unit) if measure.unit else Markup("")


def plain(value: float | None, digits: int) -> str:
    """A number, or a dash."""
    if value is None:
        return DASH
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", MINUS)  # no negative zero


def estimate(value: Estimate | None, digits: int) -> Markup:
    """A mean with its interval, the interval small."""
    if value is None:
        return NONE
    words = Markup('<span class="mean">{}</span>').format(plain(value.mean, digits))
    if value.low is None or value.high is None:
        return words
    low, high = plain(value.low, digits), plain(value.high, digits)
    return words + Markup(' <span class="range">[{}, {}]</span>').format(low, high)


def verdict(row: Row) -> Markup:
    """An arrow where a row differs from the signal's, with words for screen readers."""
    if row.difference is None or not row.difference.excludes_zero:
        return Markup("")
    sign, words = ("↓", "below") if row.difference.mean < 0 else ("↑", "above")
    return Markup(
        '<span class="{}" aria-hidden="true">{}</span>'
        '<span class="unseen">significantly {} the signal: </span>'
    ).format(words, sign, escape(words))

"""What the paper reports (table "Reduced Average Waiting Time"), and for which cells."""

from collections.abc import Iterator, Mapping

Place = tuple[str, float]
"""A cell of the paper's table: intersection and rate."""

FOLDER = "colorado-springs"  # of the scenarios
INTERSECTIONS = ("229", "449", "332", "334")  # in the order of the table
RATES = (0.4, 0.5, 0.6, 0.7)
FIGURE_RATE = 0.4  # of the figure of unregulated lanes

WANG, SIGNAL = "wang", "traffic-light"
HIERARCHICAL, TUNED = "hierarchical", "hierarchical-tuned"
METHODS = (HIERARCHICAL, TUNED)

REDUCTIONS: Mapping[str, Mapping[str, tuple[float | None, ...]]] = {
    WANG: {
        "229": (18.98, 6.66, None, None),
        "449": (31.65, 28.23, 5.74, None),
        "332": (18.48, 11.73, 35.85, 26.59),
        "334": (38.73, 54.67, 48.32, 45.82),
    },
    SIGNAL: {
        "229": (None, None, 0.51, 30.94),
        "449": (79.94, 76.71, 78.76, 69.71),
        "332": (3.94, 11.73, 20.06, 41.58),
        "334": (17.77, 39.44, 58.34, 47.82),
    },
}
"""By baseline and intersection, a figure per rate [%]; None where the paper prints ``*``."""


def cells() -> Iterator[Place]:
    """Intersection and rate of each of the sixteen cells."""
    return ((intersection, rate) for intersection in INTERSECTIONS for rate in RATES)


def reduction(baseline: str, intersection: str, rate: float) -> float | None:
    """The paper's figure [%]; None where it reports no improvement."""
    return REDUCTIONS[baseline][intersection][RATES.index(rate)]

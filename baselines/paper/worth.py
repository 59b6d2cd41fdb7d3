"""What the low level is worth: the same decisions on top, another low level below."""

from statistics import mean

from baselines.paper import published
from baselines.paper.published import HIERARCHICAL, TUNED, Place
from baselines.paper.samples import Samples
from baselines.paper.tables import code, doubt, markdown
from benchmark.records.samples import BySeed
from benchmark.records.statistics import estimates
from benchmark.reports.words import mean_and_interval, percent

PAIRS = (
    (HIERARCHICAL, f"{HIERARCHICAL}?low=random"),
    (TUNED, f"{TUNED}?low=random"),
    (f"{TUNED}?training=1", f"{TUNED}?low=random"),
    (f"{TUNED}?training=2", f"{TUNED}?low=random"),
    (TUNED, f"{TUNED}?lateral=false&low=forward"),
    (TUNED, "time-windows?braking=1"),
)
"""A controller and what it is compared with."""

LETTERS = "ABCDEFGH"


def legend() -> str:
    """Which letter of the tables stands for which pair."""
    items = zip(LETTERS, PAIRS, strict=False)
    return "\n".join(f"- {letter}: {code(name)} - {code(other)}" for letter, (name, other) in items)


def table(samples: Samples, key: str) -> str:
    """The difference of each pair in each cell, and its mean over all cells.

    Args:
        samples: what there is.
        key: of a measure.
    """
    cells = list(published.cells())
    columns = [[_differences(samples, key, pair, cell) for cell in cells] for pair in PAIRS]
    body = [
        [cell[0], percent(cell[1]), *map(_words, row)]
        for cell, row in zip(cells, zip(*columns, strict=True), strict=True)
        if any(row)
    ]
    if body:
        body.append(["mean", "", *(_words(_over_cells(column)) for column in columns)])
    return markdown(["intersection", "RVs", *LETTERS[: len(PAIRS)]], body, words=2)


def _differences(samples: Samples, key: str, pair: tuple[str, str], place: Place) -> BySeed:
    values, others = (samples.values(key, name, place) for name in pair)
    return {seed: values[seed] - others[seed] for seed in values if seed in others}


def _over_cells(column: list[BySeed]) -> BySeed:
    """The mean over cells of each seed that all cells have."""
    seeds = set.intersection(*map(set, column))
    return {seed: mean(cell[seed] for cell in column) for seed in sorted(seeds)}


def _words(differences: BySeed) -> str:
    if not differences:
        return "-"
    (estimate,) = estimates([list(differences.values())])
    return f"{mean_and_interval(estimate, 1)}{doubt(estimate)}"

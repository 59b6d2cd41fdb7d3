"""What the low level is worth: the same decisions on top, another low level below."""

from statistics import mean

from baselines.paper import published
from baselines.paper.published import HIERARCHICAL, TUNED
from baselines.paper.samples import Samples
from baselines.paper.tables import Cell, code, doubt, markdown
from benchmark.records.statistics import estimates
from benchmark.reports.tables import figure, percent

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

BySeed = dict[int, float]


def legend() -> str:
    """Which letter of the tables stands for which pair."""
    items = zip(LETTERS, PAIRS, strict=False)
    return "\n".join(f"- {letter}: {code(one)} - {code(other)}" for letter, (one, other) in items)


def table(samples: Samples, key: str) -> str:
    """The difference of each pair in each cell, and its mean over all cells.

    Args:
        samples: what there is.
        key: of a column of the leaderboard.
    """
    cells = list(published.cells())
    found = {pair: [_by_seed(samples, key, pair, cell) for cell in cells] for pair in PAIRS}
    body = [
        [cell[0], percent(cell[1]), *(_words(found[pair][index]) for pair in PAIRS)]
        for index, cell in enumerate(cells)
        if any(found[pair][index] for pair in PAIRS)
    ]
    if body:
        body.append(["mean", "", *(_words(_over_cells(found[pair])) for pair in PAIRS)])
    return markdown(["intersection", "RVs", *LETTERS[: len(PAIRS)]], body, words=2)


def _by_seed(samples: Samples, key: str, pair: tuple[str, str], cell: Cell) -> BySeed:
    one, other = (samples.values(key, name, *cell) for name in pair)
    return {seed: one[seed] - other[seed] for seed in one if seed in other}


def _over_cells(found: list[BySeed]) -> BySeed:
    """The mean over cells of each seed that all cells have."""
    seeds = set.intersection(*map(set, found))
    return {seed: mean(cell[seed] for cell in found) for seed in sorted(seeds)}


def _words(differences: BySeed) -> str:
    if not differences:
        return "-"
    (found,) = estimates([list(differences.values())])
    return f"{figure(found, 1)}{doubt(found)}"

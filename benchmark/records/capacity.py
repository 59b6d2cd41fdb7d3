"""Records of one scenario at many demands -> at which demand it jams, by controller and rate."""

from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import takewhile
from typing import TYPE_CHECKING

import numpy as np

from benchmark.records.flags import KEPT_OUT, KEPT_OUT_AT_LEAST
from benchmark.records.samples import Floats, Sample, cells_of

if TYPE_CHECKING:
    import polars

JAMMED = 2 / 3  # of the demand; where fewer get through, the intersection has jammed
"""It has also jammed where it gridlocked, or where over 5 % of the demand never entered."""


@dataclass(frozen=True)
class Curve:
    """One controller at one rate: the share of its episodes that jam, by demand."""

    scenario: str  # without the demand
    controller: str
    rate: float | None
    jammed: dict[float, float]  # total demand [veh/h] -> share of episodes
    seeds: int  # episodes at a demand, the fewest

    @property
    def capacity(self) -> float | None:
        """The greatest demand up to which no more than half of the episodes jam [veh/h].

        None where the smallest demand already jams.
        """
        holding = takewhile(lambda item: item[1] <= 0.5, sorted(self.jammed.items()))
        return max((demand for demand, _ in holding), default=None)


def capacity_curves(
    table: "polars.DataFrame", notice: Callable[[str], None] = lambda message: None
) -> list[Curve]:
    """The curves of all scenarios that were run at demands of their own, as in ``334@700``.

    Args:
        table: that ``benchmark.records.table`` made.
        notice: told which scenarios are left out.
    """
    jams: dict[tuple[str, str, float | None], dict[float, list[bool]]] = {}
    left_out = set()
    samples = dict.fromkeys((cell.sample, cell.network is None) for cell in cells_of(table))
    for sample, is_alone in samples:
        group = sample.group
        scenario, at, total = group.scenario.rpartition("@")
        if at and is_alone and len(sample.seeds):
            by_demand = jams.setdefault((scenario, group.controller, group.rate), {})
            by_demand.setdefault(float(total), []).extend(_jammed(sample, float(total)))
        elif at and not is_alone:
            left_out.add(scenario)
    for scenario in sorted(left_out):
        notice(f"{scenario}: has several junctions, each of which only a part of the demand passes")
    order = sorted(jams, key=lambda key: (key[0], key[1], -1.0 if key[2] is None else key[2]))
    return [
        Curve(
            *key,
            jammed={
                demand: sum(jammed) / len(jammed) for demand, jammed in sorted(jams[key].items())
            },
            seeds=min(map(len, jams[key].values())),
        )
        for key in order
    ]


def _jammed(sample: Sample, demand: float) -> list[bool]:
    """By episode, whether too few got through, too many never entered, or nobody moved."""

    def column(key: str) -> Floats:
        values = sample.by_seed(key)
        return np.array([values.get(seed, np.nan) for seed in sample.seeds.tolist()])

    never, counted = column("never_inserted"), column("vehicles")
    kept_out = (never >= KEPT_OUT_AT_LEAST) & (never >= KEPT_OUT * (never + counted))
    few = column("throughput") < JAMMED * demand
    locked = ~np.isnan(column("first_gridlock"))
    jammed: list[bool] = (few | kept_out | locked).tolist()
    return jammed


def capacity_markdown(curves: Iterable[Curve]) -> str:
    """The curves as Markdown tables, one for each scenario; ends in a newline."""
    from tabulate import tabulate

    by_scenario: dict[str, list[Curve]] = defaultdict(list)
    for curve in curves:
        by_scenario[curve.scenario].append(curve)
    lines = []
    for scenario, members in by_scenario.items():
        demands = sorted({demand for curve in members for demand in curve.jammed})
        head = ["controller", "RVs", "holds up to", *(f"{demand:g}" for demand in demands)]
        body = [
            [
                curve.controller,
                "any" if curve.rate is None else f"{100 * curve.rate:g} %",
                "-" if curve.capacity is None else f"{curve.capacity:g}",
                *(_share(curve.jammed.get(demand)) for demand in demands),
            ]
            for curve in members
        ]
        align = ["left", *["right"] * (len(head) - 1)]
        table = tabulate(body, head, tablefmt="github", colalign=align, disable_numparse=True)
        seeds = min(curve.seeds for curve in members)
        lines += [
            f"Share of episodes of {scenario} that jam, by total demand [veh/h], {seeds} seeds:",
            *("", table, ""),
        ]
    return "\n".join(lines)


def _share(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.0f} %"

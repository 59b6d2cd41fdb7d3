"""Records of one scenario at many demands -> at which demand it jams, by controller and rate."""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from benchmark.records.record import Record, told_apart

JAMMED = 2 / 3  # of the demand; where fewer get through, the intersection has jammed


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
        found = None
        for demand, share in sorted(self.jammed.items()):
            if share > 0.5:
                break
            found = demand
        return found


def curves(records: Iterable[Record]) -> list[Curve]:
    """The curves of all scenarios that were run at demands of their own, as in ``334@700``."""
    newest = {one.episode: one for one in told_apart(records) if one.status == "ok"}
    cells: dict[tuple[str, str, float | None], dict[float, list[bool]]] = defaultdict(
        lambda: defaultdict(list)
    )
    for record in newest.values():
        scenario, at, demand = record.scenario.rpartition("@")
        if at:
            key = (scenario, record.controller, record.rate)
            cells[key][float(demand)].append(_jammed(record, float(demand)))
    return [
        Curve(
            *key,
            jammed={demand: sum(jams) / len(jams) for demand, jams in sorted(by_demand.items())},
            seeds=min(map(len, by_demand.values())),
        )
        for key, by_demand in sorted(
            cells.items(), key=lambda cell: (*cell[0][:2], -1 if cell[0][2] is None else cell[0][2])
        )
    ]


def _jammed(record: Record, demand: float) -> bool:
    passed = sum(junction.throughput for junction in record.junctions.values())
    return passed < JAMMED * demand


def markdown(found: Iterable[Curve]) -> str:
    """The curves as Markdown tables, one for each scenario; ends in a newline."""
    from tabulate import tabulate

    by_scenario: dict[str, list[Curve]] = defaultdict(list)
    for curve in found:
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

"""What limits time windows: who enters led by an RV, and who is in the way of RVs that wait.

``python -m baselines.time_windows.analysis`` makes the table in docs/time-windows.md.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Annotated

import typer
from tabulate import tabulate

from baselines.time_windows.watched import watched
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario

LED, UNLED = "HVs behind an RV", "HVs that no RV led"


def shares(scenario: Scenario, rate: float, seeds: Sequence[int]) -> Iterator[tuple[str, float]]:
    """How many percent of the vehicles entered how, and of refusals met whom."""
    entered: Counter[str] = Counter()
    in_the_way: Counter[str] = Counter()
    refusals = 0
    for seed in seeds:
        traffic = watched(scenario, rate, seed)
        for passing in traffic.passings.values():
            if passing.entered:
                entered["RVs" if passing.is_robot else LED if passing.led else UNLED] += 1
        in_the_way += traffic.in_the_way
        refusals += traffic.refusals
    for kind in ("RVs", LED, UNLED):
        yield f"entered: {kind}", 100 * entered[kind] / max(1, entered.total())
    for kind, count in sorted(in_the_way.items()):
        yield f"in the way: {kind}", 100 * count / max(1, refusals)


def main(
    scenario: Annotated[list[str] | None, typer.Argument(help="Default: the paper's four.")] = None,
    rate: Annotated[list[float] | None, typer.Option(min=0, max=1)] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Use the seeds 1 to N.")] = 5,
) -> None:
    """Print, in percent, how vehicles entered and who was in the way of refused RVs."""
    columns = {
        f"{place.name.rpartition('/')[2]}, {100 * ran:g} %": dict(
            shares(place, ran, range(1, seeds + 1))
        )
        for place in catalogue.find_scenarios(scenario or ["colorado-springs"])
        for ran in rate or [0.4, 0.6]
    }
    names = sorted({name for column in columns.values() for name in column})
    rows = [[name, *(column.get(name, 0.0) for column in columns.values())] for name in names]
    typer.echo(tabulate(rows, ["%", *columns], tablefmt="github", floatfmt=".0f"))


if __name__ == "__main__":
    typer.run(main)

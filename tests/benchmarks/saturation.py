"""How near discharge in SUMO comes to the formula of saturation flow; docs/methods.md keeps it.

Two approaches of one cross lane each have more traffic than their green carries, so that they
discharge for as long as it lasts. Run it with ``make saturation``.
"""

import sys
from collections.abc import Iterable
from typing import Any

from factories.discharge import discharge, saturated

from benchmark.scenario.scenario import Scenario
from benchmark.sumo.network import build_network
from benchmark.sumo.saturation import saturation_flow

DRIVERS: dict[str, dict[str, Any]] = {
    "IDM, headway 1 s": {"model": "IDM", "headway": 1.0},
    "IDM, headway 1.4 s": {"model": "IDM", "headway": 1.4},
    "Krauss, headway 1 s": {"model": "Krauss", "headway": 1.0},
}
SPEEDS = (8.33, 10.0, 13.89, 20.0, 25.0)  # m/s
GREENS = (15.0, 26.0, 50.0)  # s


def formula(scenario: Scenario) -> float:
    """What `saturation_flow` says of the same lane [veh/h]."""
    (intersection,) = build_network(scenario).intersections
    return saturation_flow(scenario, intersection.movements["N-C"])


def main() -> None:
    """Print discharge over formula, a row for each driver and speed, a column for each green."""
    say("driver, speed", (f"{green:g} s" for green in GREENS))
    for name, driver in DRIVERS.items():
        for speed in SPEEDS:
            ratios = []
            for green in GREENS:
                scenario = saturated(speed, green, driver)
                ratios.append(discharge(scenario, green) / formula(scenario))
            say(f"{name}, {speed:g} m/s", (f"{ratio:.2f}" for ratio in ratios))


def say(head: str, cells: Iterable[str]) -> None:
    """Write a row of the table."""
    sys.stdout.write(f"| {head} | {' | '.join(cells)} |\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()

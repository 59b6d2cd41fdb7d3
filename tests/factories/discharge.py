"""A crossing whose queues never end, to see what a lane discharges."""

from typing import Any

from benchmark.scenario.layout import COMPASS
from benchmark.scenario.scenario import CENTRE, Scenario, parse_scenario
from benchmark.study.episode import Episode, run_episode

CROSS, LOST = 100.0, 8.0  # veh/h of each cross street, s of yellow and all-red in a cycle
WARM_UP = 300.0  # s


def saturated(
    speed: float, green: float, driver: dict[str, Any], duration: float = 2100.0
) -> Scenario:
    """A crossing whose northbound and southbound lanes always have a queue."""
    road = {"length": 300, "speed_limit": speed, "lanes": "C"}
    demand: dict[str, Any] = {"begin": 0, "end": duration}
    for name in COMPASS:
        heavy = name in ("northbound", "southbound")
        demand[name] = {"cross": 1800 if heavy else CROSS}
    document = {
        "schema": 1,
        "title": "Saturated",
        "evaluation": {"duration": duration, "warm_up": WARM_UP},
        "intersection": {"speed_cap": speed, "decision_zone": 100},
        "approaches": {name: {"heading": 90 * i, **road} for i, name in enumerate(COMPASS)},
        "demand": [demand],
        "vehicles": {"car": {"share": 1, "speed_deviation": 0.0, "car_following": driver}},
        "signal": {
            "yellow": 3,
            "all_red": 1,
            "phases": [
                {"movements": [f"{a}-C", f"{b}-C"], "green": green} for a, b in ("NS", "EW")
            ],
        },
    }
    return parse_scenario(document, source="saturated.toml", name="test/saturated")


def discharge(scenario: Scenario, green: float) -> float:
    """What a lane passes for each second of displayed green [veh/h]."""
    junction = run_episode(Episode(scenario, "traffic-light", None, 1)).junctions[CENTRE]
    cycle = 2 * green + LOST
    return (junction.throughput - 2 * CROSS) / 2 * cycle / green

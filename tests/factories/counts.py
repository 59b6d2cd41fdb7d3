"""Crossroads R C C L with counts by movement, for signals to be timed on."""

from typing import Any

from benchmark.scenario.layout import COMPASS
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal
from benchmark.sumo.saturation import saturation_flow
from factories.scenarios import parsed
from factories.traffic import CROSSROADS

KRAUSS = {"model": "Krauss", "headway": 1.0, "minimum_gap": 2.5}

PERMITTED = [
    {"movements": ["N-C", "N-L", "S-C", "S-L"], "permitted": ["N-L", "S-L"], "green": 30},
    {"movements": ["E-C", "E-L", "W-C", "W-L"], "permitted": ["E-L", "W-L"], "green": 30},
]


def counted(signal: Any = None, **counts: float) -> tuple[Scenario, Signal]:
    """The crossroads R C C L with counts by movement [veh/h], as in ``N_C=600``; others are 10."""
    changes: dict[str, Any] = {"vehicles.car": {"share": 1, "length": 5, "car_following": KRAUSS}}
    for approach in COMPASS:
        letter = approach[0].upper()
        changes[f"approaches.{approach}.lanes"] = "R C C L"
        changes[f"demand.0.{approach}"] = {
            turn: counts.get(f"{letter}_{turn[0].upper()}", 10)
            for turn in ("left", "cross", "right")
        }
    scenario = parsed(changes | ({"signal": signal} if signal else {}))
    assert scenario.signal is not None
    return scenario, scenario.signal


def lane_saturation() -> float:
    """What a lane of the crossroads discharges under Krauss [veh/h]; the same for all turns."""
    return saturation_flow(counted()[0], CROSSROADS.movements["N-C"])


def by_flow_ratios(north: float, lefts: float, east: float) -> tuple[Scenario, Signal]:
    """Counts that give critical flow ratios; cross movements have two lanes, lefts one."""
    one = lane_saturation()
    return counted(
        N_C=2 * one * north,
        S_C=one * north,
        E_C=2 * one * east,
        W_C=one * east,
        **dict.fromkeys(("N_L", "S_L", "E_L", "W_L"), one * lefts),
    )

"""Scenarios in the mirror: traffic that drives on the other side."""

import tomllib
from typing import Any

from benchmark.scenario.scenario import Scenario, parse_scenario
from factories.scenarios import SCENARIOS

ROADS = {"eastbound": "westbound", "westbound": "eastbound"}
LETTERS = str.maketrans("EWLR", "WERL")
TURNS = {"left": "right", "right": "left"}


def mirrored(name: str) -> str:
    """A movement in the mirror, as in ``W-R`` for ``E-L``."""
    return name.translate(LETTERS)


def document(name: str) -> dict[str, Any]:
    """A shipped scenario's document."""
    return tomllib.loads((SCENARIOS / f"{name}.toml").read_text())


def on_the_left(name: str) -> dict[str, Any]:
    """A shipped scenario's document in the mirror, where traffic drives on the left."""
    text = document(name)
    text["intersection"]["driving_side"] = "left"
    text["approaches"] = {
        ROADS.get(road, road): _approach(keys) for road, keys in text["approaches"].items()
    }
    text["demand"] = [
        {ROADS.get(key, key): _counts(value) for key, value in period.items()}
        for period in text["demand"]
    ]
    for phase in text["signal"]["phases"]:
        phase |= {
            key: [mirrored(movement) for movement in phase[key]]
            for key in ("movements", "permitted")
            if key in phase
        }
    return text


def left_hand(name: str) -> Scenario:
    """A shipped scenario in the mirror."""
    return parse_scenario(on_the_left(name), source=name, name=f"{name}-mirrored")


def _approach(keys: dict[str, Any]) -> dict[str, Any]:
    lanes = {"lanes": mirrored(keys["lanes"])} if "lanes" in keys else {}
    return keys | lanes | {"heading": -keys["heading"]}


def _counts(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    return {TURNS.get(turn, turn): count for turn, count in value.items()}

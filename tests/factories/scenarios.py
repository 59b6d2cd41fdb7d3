"""Shipped scenarios, and a small document to change."""

import copy
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from benchmark.scenario.layout import COMPASS
from benchmark.scenario.scenario import Scenario, load_scenario, parse_scenario
from benchmark.sumo import network
from benchmark.sumo.network import Network

ROOT = Path(__file__).parents[2]
"""Of the repository."""

SCENARIOS = ROOT / "scenarios"
SHIPPED = sorted(f"{path.parent.name}/{path.stem}" for path in SCENARIOS.glob("*/*.toml"))
PAPER = [name for name in SHIPPED if name.startswith("colorado-springs/")]
SMOKE = [name for name in SHIPPED if name.startswith("smoke/")]


@cache
def shipped(name: str) -> Scenario:
    """A scenario by its name in tables, as in ``colorado-springs/229``."""
    return load_scenario(SCENARIOS / f"{name}.toml")


def smoke(name: str) -> Scenario:
    """A scenario of scenarios/smoke."""
    return shipped(f"smoke/{name}")


def network_of(name: str) -> Network:
    """The network of a shipped scenario; built once per process."""
    return network.build_network(shipped(name))


DROP = object()
"""As a value in ``edited``: remove the key."""


def edited(changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """A small valid document, changed at dotted paths, as in ``demand.0.begin``."""
    counts = {"left": 100, "cross": 200, "right": 50}
    roads = {"length": 100, "speed_limit": 13.89, "lanes": "R C L"}
    document: dict[str, Any] = {
        "schema": 1,
        "title": "A crossing",
        "evaluation": {"duration": 60},
        "intersection": {"speed_cap": 10},
        "approaches": {name: {"heading": 90 * i, **roads} for i, name in enumerate(COMPASS)},
        "demand": [{"begin": 0, "end": 60, **{name: dict(counts) for name in COMPASS}}],
        "vehicles": {"car": {"share": 1}},
        "signal": {
            "phases": [
                {"movements": ["N-L", "S-L"], "green": 10},
                {"movements": ["N-C", "S-C"], "green": 20},
                {"movements": ["E-L", "W-L"], "green": 10},
                {"movements": ["E-C", "W-C"], "green": 20},
            ]
        },
    }
    for path, value in (changes or {}).items():
        *way, last = path.split(".")
        table: Any = document
        for part in way:
            table = table[int(part)] if isinstance(table, list) else table.setdefault(part, {})
        key: Any = int(last) if isinstance(table, list) else last
        if value is DROP:
            del table[key]
        else:
            table[key] = copy.deepcopy(value)
    return document


def parsed(changes: Mapping[str, Any] | None = None) -> Scenario:
    """The scenario of ``edited(changes)``."""
    return parse_scenario(edited(changes), source="a.toml", name="test/a")

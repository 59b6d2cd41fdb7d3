"""Route files by hand."""

from collections.abc import Sequence
from pathlib import Path

from benchmark.scenario.scenario import Scenario
from benchmark.sumo import demand
from benchmark.sumo.network import Network

LIGHT = "intersection"
Trips = Sequence[tuple[str, str, float]]
"""Vehicles by hand: id, movement, departure [s]."""


def write_routes(path: Path, scenario: Scenario, roads: Network, trips: Trips) -> Path:
    """A route file with these vehicles in the scenario's first class."""
    movements = roads.junctions[LIGHT].intersection.movements
    name, kind = next(iter(scenario.vehicles.items()))
    vehicles = [
        f'<vehicle id="{vehicle}" type="{name}" depart="{depart}" departLane="best" '
        f'departSpeed="max" speedFactor="1"><route edges="{movements[movement].approach} '
        f'{movements[movement].exit}"/></vehicle>'
        for vehicle, movement, depart in sorted(trips, key=lambda trip: trip[2])
    ]
    types = demand.vehicle_type_xml(name, kind, scenario.intersection.speed_cap)
    path.write_text("\n".join(["<routes>", types, *vehicles, "</routes>"]))
    return path

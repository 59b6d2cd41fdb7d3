"""Scenario -> SUMO network by netconvert; sumolib reads it back into movements and lanes."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmark.control.intersection import Point
from benchmark.plumbing.errors import NetworkError
from benchmark.scenario.layout import LETTERS
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import tools
from benchmark.sumo.junction import Junction, read_junction, shape_of
from benchmark.sumo.layout_xml import plain_xml

OPTIONS = ("--no-turnarounds", "true", "--offset.disable-normalization", "true")


@dataclass(frozen=True)
class Network:
    """A network file and what it means."""

    path: Path
    hash: str  # SHA-256 of the file
    junctions: Mapping[str, Junction]  # by the id of the traffic light


def build(scenario: Scenario) -> Network:
    """The scenario's network, from the cache where it was built before.

    Raises:
        NetworkError: netconvert refuses it, or it does not have the movements of the scenario.
    """
    if (known := _built.get(scenario.hash)) is None:
        known = _built[scenario.hash] = _build(scenario)
    return known


_built: dict[str, Network] = {}  # by the scenario's hash; one process meets few scenarios


def _build(scenario: Scenario) -> Network:
    first = plain_xml(scenario, setbacks={})
    sources = [Path(file).read_bytes() for file in (__file__, plain_xml.__code__.co_filename)]
    key = tools.digest(tools.sumo_version(), *sources, *OPTIONS, *first.values())

    def make(folder: Path) -> None:
        setbacks = _setbacks(_netconvert(folder, first), scenario)
        _netconvert(folder, plain_xml(scenario, setbacks))

    path = tools.cached("networks", key, make) / "net.xml"
    network = Network(path, tools.digest(path.read_bytes()), _read(path, scenario))
    _same_movements(scenario, network)
    return network


def _netconvert(folder: Path, plain: Mapping[str, str]) -> Path:
    for name, text in plain.items():
        (folder / name).write_text(text)
    target = folder / "net.xml"
    tools.run(
        "netconvert",
        *("-n", str(folder / "net.nod.xml"), "-e", str(folder / "net.edg.xml")),
        *("-x", str(folder / "net.con.xml"), "-o", str(target), *OPTIONS),
    )
    # the leading comment holds the time and the paths, which must not enter the hash
    target.write_text(re.sub(r"<!--.*?-->\n*", "", target.read_text(), flags=re.DOTALL))
    return target


def _open(path: Path) -> Any:
    import sumolib

    return sumolib.net.readNet(str(path), withInternal=True)


def _setbacks(path: Path, scenario: Scenario) -> dict[str, float]:
    """How far netconvert pulls each entrance back from the centre [m]."""
    network = _open(path)
    return {
        name: round(
            (approach.bay if approach.has_bay and approach.bay else approach.length)
            - network.getEdge(name).getLength(),
            2,
        )
        for name, approach in scenario.approaches.items()
    }


def _read(path: Path, scenario: Scenario) -> dict[str, Junction]:
    """Every junction of a network that a traffic light rules."""
    network = _open(path)
    lights = sorted(network.getTrafficLights(), key=lambda light: str(light.getID()))
    return {light.getID(): read_junction(network, light, scenario) for light in lights}


def _same_movements(scenario: Scenario, network: Network) -> None:
    """Headings may make a turn another one than its name says; say so rather than misroute."""
    wanted = {
        f"{LETTERS[name]}-{turn}"
        for name in scenario.approaches.names()
        for turn in scenario.served_turns(name)
    }
    found = {
        movement
        for junction in network.junctions.values()
        for movement in junction.intersection.movements
    }
    if wanted != found:
        raise NetworkError(
            f"{scenario.name}: the headings make other movements ({', '.join(sorted(found))}) "
            f"than approaches and lanes name ({', '.join(sorted(wanted))}); correct the headings"
        )


@dataclass(frozen=True, slots=True)
class RoadLane:
    """A lane of a road as it lies on the ground, for drawings."""

    id: str
    road: str  # id of its edge
    index: int  # 0 at the kerb
    width: float  # m
    shape: tuple[Point, ...]  # m, centre line in driving direction
    inside: bool  # whether it lies inside a junction


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What lies on the ground in a network: lanes and the areas where roads meet."""

    lanes: Mapping[str, RoadLane]
    areas: tuple[tuple[Point, ...], ...]  # m, outlines of the junctions


def surroundings(network: Network) -> Surroundings:
    """Every lane of a network, also those that leave, and the outline of every junction."""
    roads = _open(network.path)
    edges = sorted(roads.getEdges(withInternal=True), key=lambda edge: str(edge.getID()))
    lanes = (lane for edge in edges for lane in edge.getLanes())
    outlines = (node.getShape() for node in roads.getNodes())
    return Surroundings(
        lanes={lane.getID(): _road_lane(lane) for lane in lanes},
        areas=tuple(tuple((x, y) for x, y in outline) for outline in outlines if len(outline) > 2),
    )


def _road_lane(lane: Any) -> RoadLane:
    edge = lane.getEdge()
    return RoadLane(
        id=lane.getID(),
        road=edge.getID(),
        index=lane.getIndex(),
        width=lane.getWidth(),
        shape=shape_of(lane),
        inside=edge.getFunction() == "internal",
    )

"""Scenario -> SUMO network by netconvert; sumolib reads it back into movements and lanes."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from benchmark.control.intersection import Intersection
from benchmark.plumbing.errors import NetworkError
from benchmark.scenario.layout import LETTERS
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import tools
from benchmark.sumo.junction import Junction, read_junction
from benchmark.sumo.layout_xml import exit_name, plain_xml

OPTIONS = ("--no-turnarounds", "true", "--offset.disable-normalization", "true")


@dataclass(frozen=True)
class Network:
    """A network file and what it means."""

    path: Path
    hash: str  # SHA-256 of the file
    junctions: Mapping[str, Junction]  # that controllers rule, by id
    has_lights: bool = True  # at them; stop signs stand elsewhere

    @property
    def intersections(self) -> list[Intersection]:
        """The facts of its junctions."""
        return [junction.intersection for junction in self.junctions.values()]


def build_network(
    scenario: Scenario, *, stop_signs: bool = False, waiting_lefts: Collection[str] = ()
) -> Network:
    """The scenario's network, from the cache where it was built before.

    Without further words it is the one road for dark lights, whatever the scenario's program says.

    Args:
        scenario: where.
        stop_signs: whether stop signs stand where the lights would; roads are the same.
        waiting_lefts: crossing turns with a waiting point inside, for programs that permit them.

    Raises:
        NetworkError: netconvert refuses it, or it does not have the movements of the scenario.
    """
    variant = scenario.hash, stop_signs, frozenset(waiting_lefts)
    if (known := _built.get(variant)) is None:
        known = _built[variant] = _build(scenario, stop_signs, frozenset(waiting_lefts))
    return known


_built: dict[tuple[str, bool, frozenset[str]], Network] = {}  # a process meets few


def _build(scenario: Scenario, stop_signs: bool, waiting_lefts: frozenset[str]) -> Network:
    options = _options(scenario)
    plain = partial(plain_xml, scenario, stop_signs=stop_signs, waiting_lefts=waiting_lefts)
    first = plain(setbacks={})
    sources = [Path(file).read_bytes() for file in (__file__, plain_xml.__code__.co_filename)]
    key = tools.digest(tools.sumo_version(), *sources, *options, *first.values())

    def make(folder: Path) -> None:
        setbacks = _setbacks(_netconvert(folder, first, options), scenario)
        _netconvert(folder, plain(setbacks=setbacks), options)

    path = tools.cached("networks", key, make) / "net.xml"
    junctions = _read(path, scenario)
    network = Network(path, tools.digest(path.read_bytes()), junctions, not stop_signs)
    _same_movements(scenario, network)
    return network


def _options(scenario: Scenario) -> tuple[str, ...]:
    """What netconvert is told besides the roads."""
    on_the_left = scenario.intersection.driving_side == "left"
    return (*OPTIONS, "--lefthand", "true") if on_the_left else OPTIONS


def _netconvert(folder: Path, plain: Mapping[str, str], options: Sequence[str]) -> Path:
    for name, text in plain.items():
        (folder / name).write_text(text)
    target = folder / "net.xml"
    files = ["-n", folder / "net.nod.xml", "-e", folder / "net.edg.xml"]
    files += ["-x", folder / "net.con.xml", "-o", target]
    tools.run_program("netconvert", *map(str, files), *options)
    # the leading comment holds the time and the paths, which must not enter the hash
    target.write_text(re.sub(r"<!--.*?-->\n*", "", target.read_text(), flags=re.DOTALL))
    return target


def open_network(path: Path) -> Any:
    """A network as sumolib reads it, with what lies inside junctions."""
    import sumolib

    return sumolib.net.readNet(str(path), withInternal=True)


def _setbacks(path: Path, scenario: Scenario) -> dict[str, float]:
    """How far netconvert pulls each entrance back from the centre [m]."""
    network = open_network(path)
    return {
        name: round(
            (approach.bay if approach.has_bay and approach.bay else approach.length)
            - network.getEdge(name).getLength(),
            2,
        )
        for name, approach in scenario.approaches.entering()
    }


def _read(path: Path, scenario: Scenario) -> dict[str, Junction]:
    """Every junction of a network that the scenario rules."""
    network, step = open_network(path), scenario.evaluation.step
    slips = {name for name, approach in scenario.approaches.items() if approach.slip_lane}
    waiting = {name for name, approach in scenario.approaches.items() if not approach.right_on_red}
    names = _movement_names(scenario)
    return {
        name: read_junction(network, name, ruled, step, slips, waiting, names)
        for name, ruled in sorted(scenario.junctions.items())
    }


def _movement_names(scenario: Scenario) -> dict[tuple[str, str], str]:
    """The movements by the roads that they lead from and to, however skew these lie."""
    return {
        (name, exit_name(leg)): f"{LETTERS[name]}-{turn}"
        for name, _ in scenario.approaches.entering()
        for turn in scenario.approaches.served_turns(name)
        if (leg := scenario.approaches.exit_leg(name, turn))
    }


def _same_movements(scenario: Scenario, network: Network) -> None:
    """Geometry may leave no room for a way; say so rather than misroute."""
    wanted = scenario.approaches.movements()
    for junction in network.junctions.values():
        movements = sorted(junction.intersection.movements)
        if wanted != movements:
            raise NetworkError(
                f"{scenario.name}: the roads make other movements ({', '.join(movements)}) than "
                f"approaches and lanes name ({', '.join(wanted)}); lengthen bays and approaches, "
                "or turn headings apart"
            )

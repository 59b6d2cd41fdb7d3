"""Scenario -> the plain XML that netconvert reads: nodes, edges and connections.

Edge ids: ``northbound.upstream`` before the turn bay, ``northbound`` up to the entrance,
``northbound.exit`` for the road that leaves northbound, ``northbound.exit.far`` after its taper.
"""

from collections.abc import Collection, Iterator, Mapping
from math import cos, radians, sin
from xml.sax.saxutils import quoteattr

from benchmark.scenario.layout import COMPASS, LETTERS, TURNS, Approach
from benchmark.scenario.scenario import Scenario

CENTRE = "intersection"
TAPER = 100.0  # m behind the intersection after which surplus exit lanes end


def plain_xml(
    scenario: Scenario,
    setbacks: Mapping[str, float],
    *,
    stop_signs: bool = False,
    waiting_lefts: Collection[str] = (),
) -> dict[str, str]:
    """The input of netconvert: nodes, edges and connections.

    Args:
        scenario: where the geometry comes from.
        setbacks: how far netconvert pulls each approach's entrance back from the centre [m], so
            that lengths can be measured from the entrance; empty on the first pass.
        stop_signs: whether stop signs stand where the lights would.
        waiting_lefts: crossing turns that wait for gaps inside, as in ``E-L``.
    """
    kind = _stop_signs(scenario) if stop_signs else 'type="traffic_light"'
    if radius := scenario.intersection.radius:
        kind += f' radius="{radius:g}"'
    nodes = [f'<node id="{CENTRE}" x="0" y="0" {kind}/>']
    edges: list[str] = []
    connections: list[str] = []
    for name, approach in scenario.approaches.items():
        leg = _Leg(scenario, name, approach, setbacks.get(name, 0.0), stop_signs, waiting_lefts)
        nodes += leg.nodes()
        edges += leg.edges()
        connections += [*leg.lanes_into_bay(), *leg.lanes_after_exit(), *leg.ways_through()]
    return {
        "net.nod.xml": _document("nodes", nodes),
        "net.edg.xml": _document("edges", edges),
        "net.con.xml": _document("connections", connections),
    }


def _stop_signs(scenario: Scenario) -> str:
    """The centre's type in SUMO's words: all stop, or all but the approaches with priority."""
    if scenario.intersection.priority:
        return 'type="priority_stop" rightOfWay="edgePriority"'
    return 'type="allway_stop"'


def _document(root: str, lines: list[str]) -> str:
    return "\n".join([f"<{root}>", *lines, f"</{root}>", ""])


def exit_name(leg: str) -> str:
    """The id of the road that leaves on an approach's leg, as in ``northbound.exit``."""
    return f"{_opposite(leg)}.exit"


def _opposite(approach: str) -> str:
    return COMPASS[(COMPASS.index(approach) + 2) % 4]


class _Leg:
    """One leg in plain XML: the approach that arrives on it and the exit that leaves on it."""

    def __init__(
        self,
        scenario: Scenario,
        name: str,
        approach: Approach,
        setback: float,
        stop_signs: bool = False,
        waiting_lefts: Collection[str] = (),
    ) -> None:
        self.scenario, self.name, self.approach, self.setback = scenario, name, approach, setback
        self.stop_signs = stop_signs
        self.kerb_turn = scenario.intersection.kerb_turn
        self.crossing_turn = scenario.intersection.crossing_turn
        self.waits_inside = f"{LETTERS[name]}-{self.crossing_turn}" in waiting_lefts
        self.lanes = approach.lane_turns
        self.upstream = approach.upstream_lanes or len(self.lanes)
        self.onward = getattr(scenario.approaches, _opposite(name))  # arrives on the other side
        self.exit = exit_name(name)
        said = scenario.approaches.exit_lanes(name)
        self.exit_lanes = (self.upstream or 1) if said is None else said
        self.receiving = max(self.exit_lanes, self._most_lanes_into_exit())
        self.entry = f"{name}.upstream" if approach.has_bay else name
        self.length = approach.length + setback

    def _most_lanes_into_exit(self) -> int:
        """Lanes that some movement needs on this leg's exit; surplus lanes end at the taper."""
        return max(
            (
                sum(turn in lane for lane in approach.lane_turns)
                for name, approach in self.scenario.approaches.items()
                for turn in TURNS
                if self.scenario.approaches.exit_leg(name, turn) == self.name
            ),
            default=0,
        )

    @property
    def tapers(self) -> bool:
        return self.receiving > self.exit_lanes and self.length > TAPER + self.setback + 10

    def nodes(self) -> list[str]:
        nodes = [self._node("far", self.length)]
        if self.approach.has_bay:
            nodes.append(self._node("bay", (self.approach.bay or 0.0) + self.setback))
        if self.tapers:
            nodes.append(self._node("taper", TAPER + self.setback, 'type="zipper"'))
        return nodes

    def _node(self, part: str, distance: float, extra: str = "") -> str:
        """A node upstream of the entrance; headings count clockwise from north."""
        angle = radians(self.approach.heading)
        x, y = -distance * sin(angle), -distance * cos(angle)
        return f'<node id="{self.name}.{part}" x="{x:.2f}" y="{y:.2f}" {extra}/>'

    def edges(self) -> list[str]:
        name, limit = self.name, self.approach.speed_limit
        exit_limit = self.onward.speed_limit if self.onward else limit
        edges = []
        if not self.lanes:  # nobody arrives
            pass
        elif self.approach.has_bay:
            edges.append(_edge(self.entry, f"{name}.far", f"{name}.bay", self.upstream, limit))
            edges.append(
                _edge(name, f"{name}.bay", CENTRE, len(self.lanes), limit, self._priority())
            )
        else:
            edges.append(
                _edge(name, f"{name}.far", CENTRE, len(self.lanes), limit, self._priority())
            )
        if not self.receiving:  # nobody leaves
            return edges
        end = f"{name}.taper" if self.tapers else f"{name}.far"
        edges.append(_edge(self.exit, CENTRE, end, self.receiving, exit_limit))
        if self.tapers:
            edges.append(_edge(f"{self.exit}.far", end, f"{name}.far", self.exit_lanes, exit_limit))
        return edges

    def _priority(self) -> str:
        """What the road says of its priority at the centre, in netconvert's words."""
        has_it = self.stop_signs and self.name in self.scenario.intersection.priority
        return ' priority="1"' if has_it else ""

    def lanes_into_bay(self) -> Iterator[str]:
        """Kerb-turn lanes leave the kerb lane, crossing ones the innermost, the rest spread."""
        if not self.approach.has_bay:
            return
        cross = [index for index, turns in enumerate(self.lanes) if "C" in turns]
        for index, turns in enumerate(self.lanes):
            if index in cross:
                source = cross.index(index) * self.upstream // len(cross)
            elif self.kerb_turn in turns and self.crossing_turn not in turns:
                source = 0
            else:
                source = self.upstream - 1
            yield _connection(self.entry, self.name, source, index)
        served = {0, self.upstream - 1}
        served |= {place * self.upstream // len(cross) for place in range(len(cross))}
        for source in sorted(set(range(self.upstream)) - served):  # no lane may end blindly
            yield _connection(self.entry, self.name, source, min(source, len(self.lanes) - 1))

    def lanes_after_exit(self) -> Iterator[str]:
        """Where surplus receiving lanes end, the kerb lanes merge."""
        if self.tapers:
            surplus = self.receiving - self.exit_lanes
            for index in range(self.receiving):
                yield _connection(self.exit, f"{self.exit}.far", index, max(0, index - surplus))

    def ways_through(self) -> Iterator[str]:
        """Kerb turns keep to the kerb of the exit; the others to its centre line.

        Only a crossing turn (left where traffic drives on the right) that a phase of the ruling
        program permits to filter through gaps gets a waiting point inside the junction. Elsewhere
        a vehicle that stands in the middle of the box is an accident to come: with SUMO's
        waiting points everywhere, dark lights gave collisions by the dozen and rings of four
        left-turners that wait for each other forever.
        """
        for turn in TURNS:
            leg = self.scenario.approaches.exit_leg(self.name, turn)
            sources = [index for index, turns in enumerate(self.lanes) if turn in turns]
            if leg is None or not sources:
                continue
            lanes = _Leg(self.scenario, leg, self.scenario.approaches.of(leg), 0).receiving
            first = 0 if turn == self.kerb_turn else lanes - len(sources)
            for offset, source in enumerate(sources):
                waits = turn == self.crossing_turn and self.waits_inside
                extra = "" if waits else 'contPos="0"'
                yield _connection(self.name, exit_name(leg), source, first + offset, extra)


def _edge(name: str, start: str, end: str, lanes: int, limit: float, extra: str = "") -> str:
    return (
        f"<edge id={quoteattr(name)} from={quoteattr(start)} to={quoteattr(end)} "
        f'numLanes="{lanes}" speed="{limit}"{extra}/>'
    )


def _connection(source: str, target: str, lane: int, target_lane: int, extra: str = "") -> str:
    return (
        f'<connection from="{source}" to="{target}" fromLane="{lane}" toLane="{target_lane}" '
        f"{extra}/>"
    )

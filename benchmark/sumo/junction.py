"""A junction of a network: sumolib reads its movements, lanes and the ways inside."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any

from benchmark.control.intersection import Intersection, Lane, Movement, Point, Way
from benchmark.scenario.layout import COMPASS, LETTERS
from benchmark.scenario.scenario import Ruled

TURN_OF_DIRECTION = {"l": "L", "L": "L", "s": "C", "r": "R", "R": "R", "t": "U"}


@dataclass(frozen=True, slots=True)
class Inside:
    """A lane inside the junction: a piece of a movement's way."""

    movement: str
    lane: str  # id of the incoming lane that the way continues
    offset: float  # m of the way before this piece
    length: float  # m of the whole way


@dataclass(frozen=True, slots=True)
class ZoneLane:
    """A lane that reaches into the control zone."""

    end: float  # m from the lane's downstream end to the entrance
    length: float  # m
    approach: str  # the incoming edge it leads to


@dataclass(frozen=True)
class Junction:
    """One controlled intersection with the names that SUMO has for its parts."""

    intersection: Intersection
    links: Mapping[int, str]  # index in the traffic light's state -> movement
    zone: Mapping[str, ZoneLane]
    inside: Mapping[str, Inside]
    roads: Mapping[tuple[str, str], str]  # (incoming edge, outgoing edge) -> movement
    yielding: frozenset[str] = (
        frozenset()
    )  # movements that a light never stops: kerb turns from slip lanes
    waiting: frozenset[str] = frozenset()  # kerb turns that may not go on red


def movement_of(junction: Junction, route: tuple[str, ...]) -> str | None:
    """The movement by which a route (edge ids) crosses a junction, or None if it does not."""
    return next((junction.roads[road] for road in pairwise(route) if road in junction.roads), None)


def read_junction(
    network: Any,
    name: str,
    ruled: Ruled,
    step: float,
    slip_roads: Collection[str] = (),
    waiting_roads: Collection[str] = (),
    names: Mapping[tuple[str, str], str] = MappingProxyType({}),
) -> Junction:
    """The junction that a traffic light rules, or stop signs.

    Args:
        network: as sumolib reads it, with what lies inside junctions.
        name: the id of one of its traffic lights, or of a junction without one.
        ruled: what the scenario says of the junction.
        step: simulated time between two calls of a controller [s].
        slip_roads: incoming edges whose kerb turns leave by a slip lane.
        waiting_roads: incoming edges whose kerb turns may not go on red.
        names: of movements by (incoming edge, outgoing edge), as in ``E-L``; where there is none,
            the direction that SUMO sees tells the turn.
    """
    junction = _Reader(network, name, ruled, step, names).junction()
    kerb_turns = [turn for turn in junction.intersection.movements.values() if turn.keeps_to_kerb]
    return replace(
        junction,
        yielding=frozenset(turn.id for turn in kerb_turns if turn.approach in slip_roads),
        waiting=frozenset(
            turn.id for turn in kerb_turns if turn.approach in {*waiting_roads} - {*slip_roads}
        ),
    )


class _Reader:
    """Reads one junction: everything from connections, foes and shapes, nothing from names."""

    def __init__(
        self,
        network: Any,
        name: str,
        ruled: Ruled,
        step: float,
        names: Mapping[tuple[str, str], str],
    ) -> None:
        self.network, self.name, self.ruled, self.step = network, name, ruled, step
        lit = any(light.getID() == name for light in network.getTrafficLights())
        self.links = self._lit_connections() if lit else self._signed_connections()
        self.names = self._movement_names(names)

    def _lit_connections(self) -> dict[int, Any]:
        """The connections that the light rules, by their place in its state."""
        links = {}
        for source, target, index in self.network.getTLS(self.name).getConnections():
            links[index] = next(
                connection
                for connection in source.getOutgoing()
                if connection.getToLane() is target and connection.getTLSID() == self.name
            )
        return dict(sorted(links.items()))

    def _signed_connections(self) -> dict[int, Any]:
        """The connections through a junction without a light, by their place in its matrix."""
        links = {
            connection.getJunctionIndex(): connection
            for edge in self.network.getNode(self.name).getIncoming()
            if edge.getFunction() != "internal"
            for connections in edge.getOutgoing().values()
            for connection in connections
        }
        return dict(sorted(links.items()))

    def _movement_names(self, given: Mapping[tuple[str, str], str]) -> dict[tuple[str, str], str]:
        """The name of each (incoming edge, outgoing edge)."""
        names: dict[tuple[str, str], str] = {}
        for link in self.links.values():
            road = (link.getFrom().getID(), link.getTo().getID())
            turn = TURN_OF_DIRECTION.get(link.getDirection())
            if road in given:
                names[road] = given[road]
            if turn is None or road in names:
                continue
            name = f"{LETTERS.get(road[0], road[0])}-{turn}"
            names[road] = name if name not in names.values() else f"{name}:{road[1]}"
        return names

    def _movement(self, link: Any) -> str:
        return self.names[link.getFrom().getID(), link.getTo().getID()]

    def junction(self) -> Junction:
        movements = self._movements()
        zones, signal = self.ruled.zones, self.ruled.signal
        intersection = Intersection(
            id=self.name,
            control_zone=zones.control_zone,
            decision_zone=zones.decision_zone,
            step=self.step,
            lanes=MappingProxyType(self._lanes()),
            movements=MappingProxyType(movements),
            phases=MappingProxyType(signal.movements_by_phase() if signal else {}),
            driving_side=zones.driving_side,
        )
        return Junction(
            intersection=intersection,
            links={index: self._movement(link) for index, link in self.links.items()},
            zone=self._zone(zones.control_zone),
            inside=dict(self._inside()),
            roads=self.names,
        )

    def _approaches(self) -> list[Any]:
        edges = {link.getFrom().getID(): link.getFrom() for link in self.links.values()}
        return [
            edges[name]
            for name in sorted(
                edges, key=lambda name: (COMPASS.index(name) if name in COMPASS else 9, name)
            )
        ]

    def _lanes(self) -> dict[str, Lane]:
        lanes = {}
        for edge in self._approaches():
            for lane in edge.getLanes():
                served = [link for link in self.links.values() if link.getFromLane() is lane]
                lanes[lane.getID()] = Lane(
                    id=lane.getID(),
                    approach=edge.getID(),
                    index=lane.getIndex(),
                    movements=tuple(sorted({self._movement(link) for link in served})),
                    length=lane.getLength(),
                    width=lane.getWidth(),
                    speed_limit=lane.getSpeed(),
                    shape=shape_of(lane),
                )
        return lanes

    def _movements(self) -> dict[str, Movement]:
        conflicts = self._conflicts()
        movements = {}
        for edge in self._approaches():
            for turn in "LCRU":
                for (source, target), name in sorted(self.names.items()):
                    if source != edge.getID() or _turn_of(name) != turn:
                        continue
                    links = [link for link in self.links.values() if self._movement(link) == name]
                    movements[name] = Movement(
                        id=name,
                        approach=source,
                        turn=turn,
                        exit=target,
                        ways=tuple(self._way(link) for link in links),
                        conflicts=frozenset(conflicts[name]),
                        kerb_turn=self.ruled.zones.kerb_turn,
                    )
        return movements

    def _pieces(self, link: Any) -> list[Any]:
        """The lanes inside the junction along a connection; crossing turns may have two."""
        pieces = []
        via = link.getViaLaneID()
        while via:
            lane = self.network.getLane(via)
            pieces.append(lane)
            via = next((onward.getViaLaneID() for onward in lane.getOutgoing()), "")
        return pieces

    def _way(self, link: Any) -> Way:
        pieces = self._pieces(link)
        points = [point for piece in pieces for point in shape_of(piece)]
        return Way(
            lane=link.getFromLane().getID(),
            exit_lane=link.getToLane().getID(),
            length=sum(piece.getLength() for piece in pieces),
            speed_limit=min(piece.getSpeed() for piece in pieces),
            shape=tuple(dict.fromkeys(points)),
        )

    def _inside(self) -> Iterable[tuple[str, Inside]]:
        for link in self.links.values():
            pieces = self._pieces(link)
            total = sum(piece.getLength() for piece in pieces)
            offset = 0.0
            for piece in pieces:
                source = link.getFromLane().getID()
                yield piece.getID(), Inside(self._movement(link), source, offset, total)
                offset += piece.getLength()

    def _conflicts(self) -> dict[str, set[str]]:
        """Movements of different approaches whose connections SUMO calls foes.

        Kerb turns stay out: they merge, and nobody regulates them.
        """
        conflicts: dict[str, set[str]] = {name: set() for name in self.names.values()}
        links = [
            (link, self._movement(link), link.getJunction(), link.getJunctionIndex())
            for link in self.links.values()
            if _turn_of(self._movement(link)) != self.ruled.zones.kerb_turn
        ]
        for link, name, node, index in links:
            for other, other_name, other_node, other_index in links:
                apart = link.getFrom() is not other.getFrom() and node is other_node
                if apart and node.areFoes(index, other_index):
                    conflicts[name].add(other_name)
                    conflicts[other_name].add(name)
        return conflicts

    def _zone(self, reach: float) -> dict[str, ZoneLane]:
        """Lanes that reach into the control zone, upstream as far as it goes."""
        zone: dict[str, ZoneLane] = {}
        waiting = [(edge, 0.0, edge.getID()) for edge in self._approaches()]
        while waiting:
            edge, end, approach = waiting.pop()
            for lane in edge.getLanes():
                zone[lane.getID()] = ZoneLane(end, lane.getLength(), approach)
            start = end + edge.getLength()
            if start >= reach:
                continue
            for source, links in edge.getIncoming().items():
                if edge.getFromNode().getType().startswith("traffic_light"):
                    continue
                between = [
                    self.network.getLane(link.getViaLaneID())
                    for link in links
                    if link.getViaLaneID()
                ]
                for lane in between:
                    zone[lane.getID()] = ZoneLane(start, lane.getLength(), approach)
                gap = max((lane.getLength() for lane in between), default=0.0)
                waiting.append((source, start + gap, approach))
        return zone


def _turn_of(movement: str) -> str:
    """The turn in a movement's name, as in ``E-L`` or ``E-L:road``."""
    return movement.split(":")[0][-1]


def shape_of(lane: Any) -> tuple[Point, ...]:
    """The centre line of a lane, in centimetres [m]."""
    return tuple((round(x, 2), round(y, 2)) for x, y in lane.getShape())

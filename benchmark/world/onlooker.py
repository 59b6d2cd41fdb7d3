"""Whoever is told what happens in a world and changes nothing there, as a recorder of replays."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

from benchmark.scenario.scenario import Scenario
from benchmark.sumo.network import Network
from benchmark.sumo.simulation import Pose, Size
from benchmark.world.rules import Orders
from benchmark.world.tracking import Log


@dataclass(frozen=True, slots=True)
class Newcomer:
    """What an onlooker is told of a vehicle when it first appears."""

    is_robot: bool
    movement: str
    vehicle_class: str
    size: Size


class Onlooker(Protocol):
    """Looks on; a world without one does nothing for it."""

    def begin(self, scenario: Scenario, network: Network, logs: Mapping[str, Log]) -> None:
        """An episode begins.

        Args:
            scenario: what runs.
            network: its network.
            logs: who will have been in each junction's control zone.
        """

    def strangers(self, poses: Iterable[Pose]) -> list[str]:
        """The vehicles that have not been met."""

    def meet(self, vehicle: str, newcomer: Newcomer) -> None:
        """A vehicle appears."""

    def see(
        self,
        time: float,
        poses: Collection[Pose],
        colliding: Iterable[tuple[str, str]],
        lights: Mapping[str, str],
    ) -> None:
        """A step was made.

        Args:
            time: now [s].
            poses: of all vehicles on the road, all of them met.
            colliding: pairs that collide now.
            lights: the state of each signal that is on.
        """

    def order(self, orders: Orders) -> None:
        """RVs are told something in this step."""

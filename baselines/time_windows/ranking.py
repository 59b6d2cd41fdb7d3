"""Which lane comes first when windows clash."""

from collections.abc import Iterable
from typing import NamedTuple

from baselines.time_windows.queues import Queue
from benchmark.control.intersection import Intersection
from benchmark.control.state import Vehicle


class RankWeights(NamedTuple):
    """What makes a lane rank high."""

    waiting: float  # vehicles that a second of waiting is worth to each [1/s]
    longest_waiting: float  # s, from which waiting counts no more
    flowing: float  # factor while a lane's movement flows
    joining: float  # factor for a movement that could join those that flow
    green: float  # s that a movement flows with its factor
    gap: float  # s without an accepted RV after which a movement flows no more
    patience: float  # s that a lane's first RV is refused before everybody makes way for it


class Ranking:
    """Ranks lanes by their vehicles and waiting, and remembers what flows and who was refused.

    Args:
        intersection: where.
        weights: of what counts.
    """

    def __init__(self, intersection: Intersection, weights: RankWeights) -> None:
        self._intersection, self._weights = intersection, weights
        self._flowing: dict[str, tuple[float, float]] = {}  # movement -> (first, last time) [s]
        self._refused: dict[str, float] = {}  # first RV of a lane -> refused since [s]

    def order(self, queues: Iterable[Queue], time: float) -> list[Queue]:
        """The lanes with an RV that can stop: overdue ones first, then by rank, then by id."""
        ranked = [
            (not self.overdue(queue, time), -self.rank(queue, time), queue.lane, queue)
            for queue in queues
            if queue.platoons
        ]
        return [queue for *_, queue in sorted(ranked, key=lambda entry: entry[:3])]

    def overdue(self, queue: Queue, time: float) -> bool:
        """Whether a lane's first RV has been refused for longer than is bearable."""
        first = queue.platoons[0].leader.id
        return time - self._refused.get(first, time) > self._weights.patience

    def rank(self, queue: Queue, time: float) -> float:
        """How urgent a lane is [vehicles]."""
        waiting, longest = self._weights.waiting, self._weights.longest_waiting
        urgency = sum(1 + waiting * min(vehicle.waiting, longest) for vehicle in queue.vehicles)
        return urgency * self._factor(queue.platoons[0].leader.movement, time)

    def _factor(self, movement: str, time: float) -> float:
        weights = self._weights
        green = {name for name, (first, _) in self._flowing.items() if time - first < weights.green}
        if movement in self._flowing:
            return weights.flowing if movement in green else 1.0
        conflicts = self._intersection.movements[movement].conflicts
        return weights.joining if green and not green & conflicts else 1.0

    def remember(
        self, accepted: Iterable[Vehicle], refused: Iterable[Vehicle], time: float
    ) -> None:
        """Take note of a step's decisions.

        Args:
            accepted: RVs.
            refused: RVs that are the first of their lane.
            time: now [s].
        """
        for movement in {vehicle.movement for vehicle in accepted}:
            first, _ = self._flowing.get(movement, (time, time))
            self._flowing[movement] = (first, time)
        self._flowing = {
            movement: times
            for movement, times in self._flowing.items()
            if time - times[1] <= self._weights.gap
        }
        self._refused = {vehicle.id: self._refused.get(vehicle.id, time) for vehicle in refused}

"""When an intersection is gridlocked: vehicles stand at it and none gets in."""

from benchmark.control.intersection import Intersection
from benchmark.control.state import STATIONARY, TrafficState
from benchmark.scenario.signal import Signal

GRIDLOCK_AFTER = 90.0  # s in which nobody enters although some stand


def gridlock_after(signal: Signal | None) -> float:
    """How long nobody enters before it is a gridlock, and no red light [s]: a cycle at least."""
    return max(GRIDLOCK_AFTER, signal.cycle) if signal else GRIDLOCK_AFTER


class GridlockWatch:
    """Watches one intersection through one episode.

    A gridlock has begun where for ``after`` seconds some vehicle of a left or cross movement stood
    in the control zone at every step, and none of them entered the intersection. Right turns do
    not count: they get through beside a blocked box.

    Args:
        intersection: where.
        after: how long it takes to be one [s].
    """

    def __init__(self, intersection: Intersection, after: float = GRIDLOCK_AFTER) -> None:
        self.first: float | None = None
        """When the first one began [s]."""
        self._regulated = frozenset(intersection.regulated_movements)
        self._after = after
        self._flowed = self._now = 0.0  # s; when somebody last entered or nobody stood
        self._inside: frozenset[str] = frozenset()

    def see(self, state: TrafficState) -> None:
        """Take the traffic of one step."""
        inside = frozenset(
            crossing.id for crossing in state.inside if crossing.movement in self._regulated
        )
        standing = any(
            vehicle.speed < STATIONARY and vehicle.movement in self._regulated
            for vehicle in state.vehicles
        )
        self._now = state.time
        if not standing or inside - self._inside:
            self._flowed = state.time
        self._inside = inside
        if self.first is None and self.gridlocked:
            self.first = self._flowed

    @property
    def gridlocked(self) -> bool:
        """Whether it is gridlocked now."""
        return self._now - self._flowed >= self._after

    @property
    def exposure(self) -> float:
        """The time so far in which a first gridlock could have begun and be known of [s]."""
        return max(0.0, self._now - self._after) if self.first is None else self.first

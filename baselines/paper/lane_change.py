"""Finds the lane change that regulates a lane longest, as in the paper's example."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from benchmark.control.guard import ControllerFailedError, Decider
from benchmark.control.state import TrafficState
from benchmark.plumbing.errors import ControllerError
from benchmark.study.episode import Episode, opened, world_of


@dataclass(frozen=True)
class LaneChange:
    """An RV leaves a lane with another RV on it for a lane that had none."""

    vehicle: str
    source: str  # id of the lane it leaves, which stays regulated
    target: str  # id of the lane it regulates
    told: bool  # whether its controller asked for it, or the RV did so by itself
    before: TrafficState
    after: TrafficState  # the first with the vehicle on its new lane
    until: float  # s since the episode began; from then on no RV is on the lane

    @property
    def duration(self) -> float:
        """How long the lane stays regulated [s]."""
        return self.until - self.after.time


class Search:
    """Follows one intersection through an episode and gathers its lane changes."""

    def __init__(self) -> None:
        self.changes: list[LaneChange] = []
        self._before: TrafficState | None = None
        self._regulated_by: dict[str, LaneChange] = {}  # by lane, while it stays regulated

    def see(self, state: TrafficState, asked: Mapping[str, int]) -> None:
        """Take the traffic of one step.

        Args:
            state: what is to be seen now.
            asked: the lane changes that were asked for since the last step: RV -> index of a lane.
        """
        for lane in self._regulated_by.keys() & set(state.unregulated_lanes):
            self._close(lane, state.time)
        if self._before is not None:
            for change in _changes(self._before, state, asked):
                self._regulated_by[change.target] = change
        self._before = state

    def finish(self) -> list[LaneChange]:
        """All lane changes; lanes that are regulated still are so until the last step."""
        if self._before is not None:
            for lane in list(self._regulated_by):
                self._close(lane, self._before.time)
        return self.changes

    def _close(self, lane: str, time: float) -> None:
        change = self._regulated_by.pop(lane)
        self.changes.append(replace(change, until=time))


def _changes(
    before: TrafficState, after: TrafficState, asked: Mapping[str, int]
) -> Iterator[LaneChange]:
    """The lane changes of one step that left no lane unregulated and regulated another."""
    lanes = after.intersection.lanes
    free, regulated = set(before.unregulated_lanes), set(after.intersection.regulated_lanes)
    was = {vehicle.id: vehicle.lane for vehicle in before.vehicles if vehicle.is_robot}
    led_before = Counter(was.values())
    led = Counter(vehicle.lane for vehicle in after.vehicles if vehicle.is_robot)
    for vehicle in after.vehicles:
        source = was.get(vehicle.id)
        if source is None or source not in regulated or vehicle.lane not in free:
            continue
        if led_before[source] > 1 and led[source] and led[vehicle.lane] == 1:
            told = asked.get(vehicle.id) == lanes[vehicle.lane].index
            yield LaneChange(vehicle.id, source, vehicle.lane, told, before, after, after.time)


def in_episode(episode: Episode) -> list[LaneChange]:
    """Run an episode and find its lane changes that regulate a lane.

    Raises:
        RightOfWayError: the scenario cannot be run, or the controller refuses it or fails.
    """
    where = f"{episode.label} on {episode.scenario.name}"
    try:
        with opened(episode) as controller:
            decider = controller.decider(episode.scenario)
            if decider.unsupported:
                raise ControllerError(f"{where}: {decider.unsupported}")
            return _watched(episode, decider)
    except ControllerFailedError as fault:
        raise ControllerError(f"{where}: {fault}") from fault


def _watched(episode: Episode, decider: Decider) -> list[LaneChange]:
    world = world_of(episode, decider)
    searches = {name: Search() for name in world.sites}
    asked: dict[str, Mapping[str, int]] = {name: {} for name in world.sites}
    with world:
        while not world.over:
            for name, state in world.step().items():
                searches[name].see(state, asked[name])
                orders = decider.act(name, state, world.sites[name].rules)
                asked[name] = orders.lanes
                world.carry_out(name, orders, state.time)
    return [change for search in searches.values() for change in search.finish()]


def longest(changes: Sequence[LaneChange]) -> LaneChange:
    """The one after which its lane stays regulated longest; those that were asked for first."""
    return max(changes, key=lambda change: (change.told, change.duration))


def first_asked_for(episodes: Iterable[Episode]) -> tuple[Episode, list[LaneChange]] | None:
    """Run episodes until a controller asks for such a lane change.

    Returns:
        The episode and its lane changes; where nobody asks for one, the episode with the longest
        that an RV makes by itself; None where there is none at all.

    Raises:
        RightOfWayError: as ``in_episode``.
    """
    best: tuple[Episode, list[LaneChange]] | None = None
    for episode in episodes:
        changes = in_episode(episode)
        if any(change.told for change in changes):
            return episode, changes
        if changes and (best is None or _duration(changes) > _duration(best[1])):
            best = episode, changes
    return best


def _duration(changes: Sequence[LaneChange]) -> float:
    return max(change.duration for change in changes)


def words(episode: Episode, changes: Sequence[LaneChange]) -> str:
    """What the longest lane change of an episode was, in Markdown."""
    shown = longest(changes)
    asked = sum(change.told for change in changes)
    who = "its controller asked for it" if shown.told else "it did so by itself, as HVs do"
    return (
        f"At {shown.after.time:g} s of {episode.scenario.name} at {100 * (episode.rate or 0):g} % "
        f"RVs, seed {episode.seed}, under `{episode.label}`, the RV `{shown.vehicle}` leaves "
        f"the lane `{shown.source}`, on which another RV stays, for `{shown.target}`, which had "
        f"none; {who}. From then on that lane has an RV for {shown.duration:g} s. In this episode "
        f"{len(changes)} RVs changed lanes so, {asked} of them because their controller asked."
    )

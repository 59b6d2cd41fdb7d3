"""What RVs earn for what the traffic is like after each step."""

from collections import Counter
from collections.abc import Mapping, Sequence

from pydantic import Field

from benchmark.control.state import STATIONARY, TrafficState, Vehicle
from benchmark.plumbing.models import Table


class DrivingReward(Table):
    """What an RV earns in a step; only the first part is published (paper, "Reward").

    The published part is the team's. The others tell an RV what it can change: the lanes of its own
    approach, whom it leads, and its own pace.
    """

    waiting: float = Field(1.0, ge=0, description="cost of the sum of normalised waiting")
    longest_wait: float = Field(200.0, gt=0, description="waiting that counts as 1 [s]")
    standing: float = Field(0.0, ge=0, description="cost of a standing vehicle of the own approach")
    leads: float = Field(
        0.0, ge=0, description="for each HV more that it alone leads since it changed lanes"
    )
    pace: float = Field(0.0, ge=0, description="cost of standing, less the faster the ego drives")


class Earnings:
    """What RVs earn, step by step.

    Args:
        reward: its parts.
    """

    def __init__(self, reward: DrivingReward) -> None:
        self._reward = reward
        self._before: dict[str, tuple[str, int]] = {}  # lane, and HVs that it alone led there

    def of(self, state: TrafficState, egos: Sequence[Vehicle]) -> tuple[dict[str, float], float]:
        """What each ego earns, by id, and what one that has just got out does.

        Args:
            state: the traffic after the step.
            egos: RVs that are still there.
        """
        reward = self._reward
        normalised = (min(1.0, vehicle.waiting / reward.longest_wait) for vehicle in state.vehicles)
        team = -reward.waiting * sum(normalised)
        standing = _standing(state) if reward.standing else Counter()
        led = led_alone(state) if reward.leads else {}
        lanes = state.intersection.lanes
        earned = {}
        for ego in egos:
            lane = lanes.get(ego.lane)
            fastest = lane.speed_limit if lane else ego.body.maximum_speed
            earned[ego.id] = (
                team
                - reward.standing * (standing[lane.approach] if lane else 0)
                + reward.leads * self._claimed(ego, led)
                - reward.pace * max(0.0, 1.0 - ego.speed / fastest)
            )
        self._before = {ego.id: (ego.lane, led.get(ego.id, 0)) for ego in egos}
        return earned, team

    def _claimed(self, ego: Vehicle, led: Mapping[str, int]) -> int:
        """How many HVs more an RV alone leads for having changed lanes; arrivals do not count."""
        now = (ego.lane, led.get(ego.id, 0))
        lane, before = self._before.get(ego.id, now)
        return 0 if lane == ego.lane else now[1] - before


def _standing(state: TrafficState) -> Counter[str]:
    """Vehicles that stand before the entrance, by approach."""
    lanes = state.intersection.lanes
    return Counter(
        lanes[vehicle.lane].approach
        for vehicle in state.vehicles
        if vehicle.speed < STATIONARY and vehicle.lane in lanes
    )


def led_alone(state: TrafficState) -> dict[str, int]:
    """How many HVs each RV leads that nobody would lead without it: a difference reward.

    The first RV of a lane leads the HVs behind it, up to the next RV; any other RV adds nobody.
    """
    by_lane: dict[str, list[Vehicle]] = {}
    for vehicle in state.vehicles:
        by_lane.setdefault(vehicle.lane, []).append(vehicle)
    led = {}
    for vehicles in by_lane.values():
        vehicles.sort(key=lambda vehicle: vehicle.distance)
        robots = [place for place, vehicle in enumerate(vehicles) if vehicle.is_robot]
        if robots:
            first, end = robots[0], (*robots, len(vehicles))[1]
            led[vehicles[first].id] = end - first - 1
    return led

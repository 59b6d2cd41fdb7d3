"""The tuned hierarchy: what its low level sees and earns, and what it may do."""

from typing import Any

import numpy as np
import pytest
from factories.scenarios import smoke
from factories.traffic import CAR, CROSSROADS, drawn, state, vehicle
from hypothesis import given
from hypothesis import strategies as st

from baselines.hierarchical.hierarchy import Low
from baselines.hierarchical.local_observation import SIZE, LocalObserver
from baselines.hierarchical.reward import DrivingReward, Earnings, led_alone
from baselines.hierarchical.tuned import HierarchicalTuned
from baselines.time_windows.queues import MARGIN, Queue, to_the_line
from benchmark.control.arbitration import STOP_MARGIN
from benchmark.control.controller import Drive
from benchmark.control.state import Crossing, Vehicle
from benchmark.learning.observation import Numbers
from benchmark.world.world import World

EGO = vehicle("ego", lane="northbound_1", distance=40.0, speed=10.0, waiting=30.0)
AHEAD = vehicle("ahead", lane="northbound_1", distance=20.0, speed=5.0)
LEFT = [
    vehicle("hv ahead", lane="northbound_2", distance=30.0, speed=2.0, is_robot=False),
    vehicle("hv behind", lane="northbound_2", distance=50.0, speed=2.0, is_robot=False),
    vehicle("hv last", lane="northbound_2", distance=60.0, speed=0.0, is_robot=False),
]


def seen(*who: Vehicle, refused: tuple[str, ...] = ()) -> list[float]:
    observer = LocalObserver(CROSSROADS)
    lanes: dict[str, list[Vehicle]] = {}
    for one in sorted(who, key=lambda one: one.distance):
        lanes.setdefault(one.lane, []).append(one)
    observer.look([Queue(name, vehicles) for name, vehicles in lanes.items()], refused)
    found: Numbers = observer.observe(state(*who), [EGO])
    assert found.shape == (1, SIZE)
    return [round(float(number), 4) for number in found[0]]


def test_the_low_level_sees_itself_its_lane_and_whom_it_could_lead_beside() -> None:
    assert seen(EGO, AHEAD, *LEFT, refused=("ego",)) == [
        *(0.4, 0.5, 0.5, 0.0, 1.0, 0.0),  # distance, speed, waiting, straight on, refused, inside
        *(0.4, 1 / 8),  # RVs, standing vehicles of the approach
        *(1.0, 0.0, 0.0, 0.2, 1.0, 0.25),  # own lane: led, nobody unled, nobody behind
        *(1.0, 0.0, 0.25, 0.5, 0.1, 0.1, 0.1),  # left: serves, not led, one unled, two to lead
        *(0.0,) * 7,  # right: for right turns only
    ]


def test_in_a_lane_that_an_rv_leads_there_is_nobody_to_lead() -> None:
    leader = vehicle("leader", lane="northbound_2", distance=10.0)
    next_rv = vehicle("next", lane="northbound_2", distance=55.0)
    _, led, unled, followers, *_ = seen(EGO, leader, *LEFT, next_rv)[14:21]
    assert (led, unled, followers) == (1.0, 0.0, 0.0)


def test_an_empty_road_is_seen_as_far_and_fast() -> None:
    assert seen(EGO)[8:14] == [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]


def earned(reward: DrivingReward, *steps: tuple[Vehicle, ...]) -> tuple[float, float]:
    """What the ego, first of each step's vehicles, earns after the last step, and one that left."""
    earnings = Earnings(reward)
    for who in steps:
        found, otherwise = earnings.of(state(*who), who[:1])
    return found["ego"], otherwise


def test_the_published_reward_is_the_sum_of_normalised_waiting() -> None:
    ego = EGO._replace(waiting=0.0)
    waits = [vehicle(str(wait), "E-C", lane="eastbound_1", waiting=wait) for wait in (50.0, 999.0)]
    assert earned(DrivingReward(), (ego, *waits)) == (-1.25, -1.25)


def test_the_local_parts_are_of_the_own_approach_and_the_own_pace() -> None:
    elsewhere = vehicle("e", "E-C", lane="eastbound_1", speed=0.0, is_robot=False)
    standing = DrivingReward(waiting=0.0, standing=0.5)
    assert earned(standing, (EGO, elsewhere)) == (0.0, 0.0)
    assert earned(standing, (EGO, *LEFT, elsewhere)) == (-0.5, 0.0)
    limit = CROSSROADS.lanes[EGO.lane].speed_limit
    found, _ = earned(DrivingReward(waiting=0.0, pace=2.0), (EGO,))
    assert found == pytest.approx(-2 * (1 - 10 / limit))


def test_an_rv_earns_for_the_hvs_that_it_comes_to_lead_alone_and_for_nothing_else() -> None:
    leads = DrivingReward(waiting=0.0, leads=0.5)
    behind = (EGO, AHEAD, *LEFT)  # an RV is ahead of it
    claims = (EGO._replace(lane="northbound_2"), AHEAD, *LEFT)
    assert led_alone(state(*claims)) == {"ego": 2, "ahead": 0}
    assert earned(leads, behind, claims) == (2 * 0.5, 0.0)
    assert earned(leads, claims, claims) == (0.0, 0.0)  # staying there earns no more
    assert earned(leads, claims, behind) == (-2 * 0.5, 0.0)
    other = vehicle("other", lane="northbound_2", distance=10.0)
    assert earned(leads, (*behind, other), (*claims, other)) == (0.0, 0.0)
    arrived = vehicle("new", lane="northbound_2", distance=70.0, is_robot=False)
    assert earned(leads, claims, (*claims, arrived)) == (0.0, 0.0)  # it only drove up


@given(st.floats(0.0, 90.0), st.floats(0.0, 20.0), st.floats(1.0, 4.0))
def test_who_keeps_to_the_line_can_always_stop_before_it(
    distance: float, speed: float, braking: float
) -> None:
    step = 1.0
    keeps = to_the_line(vehicle(distance=distance, speed=speed), braking, step)
    assert keeps >= -CAR.deceleration
    after = max(0.0, speed + keeps * step)
    left = distance - after * step
    if keeps > -CAR.deceleration:  # else it was too fast before
        assert left - MARGIN - STOP_MARGIN + 1e-6 >= after**2 / (2 * braking) or after == 0


class Always:
    """A low level that wants full speed and the lane to the left."""

    def __call__(self, state: Any, egos: Any) -> Numbers:
        self.egos = [ego.id for ego in egos]
        return np.tile(np.array([1.0, -1.0], dtype=np.float32), (len(egos), 1))


def test_refused_rvs_brake_whatever_the_low_level_wants_and_accepted_ones_drive_themselves() -> (
    None
):
    where = drawn()
    controller = HierarchicalTuned(low="forward")
    controller.reset(where, seed=1)
    controller.low_level = low = Always()
    first = EGO._replace(distance=9.0, speed=5.0)
    second = EGO._replace(id="second", distance=30.0, speed=5.0)
    assert controller.act(state(first, second, where=where)) == {}
    way = where.movements["E-C"].ways[0]
    blocks = Crossing("hv", False, "E-C", way.lane, 4.0, way.length, 0.0, CAR)
    commands = controller.act(state(first, second, blocks, where=where))
    assert low.egos == ["ego", "second"]
    assert commands == {
        "ego": Drive(to_the_line(first, controller._windows.braking, 1.0), 1),
        "second": Drive(CAR.acceleration, 1),
    }


@pytest.mark.parametrize("low", ["forward", "random"])
def test_an_episode_runs_without_a_collision(low: Low) -> None:
    controller = HierarchicalTuned(low=low)
    world = World(smoke("crossing"), 0.6, 1001, controller="tuned", arbitration="own")
    ((name, site),) = world.sites.items()
    controller.reset(site.junction.intersection, seed=1001)
    with world:
        while not world.over:
            seen = world.step()[name]
            world.carry_out(name, site.rules.decide(seen, controller.act(seen)), seen.time)
        trips = world.finish()
    assert trips.arrived > 20
    assert trips.collisions_with_robot == 0
    assert not site.rules.refusals

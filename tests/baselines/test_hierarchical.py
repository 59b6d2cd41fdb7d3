"""The hierarchy: its safety mechanism value by value, and what each level is asked and does."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from factories.scenarios import smoke
from factories.traffic import CAR, CROSSROADS, crossing, state, vehicle
from hypothesis import given
from hypothesis import strategies as st

from baselines.hierarchical.controller import Hierarchical
from baselines.hierarchical.observation import SIZE, LateralObserver
from baselines.hierarchical.policy import Forward, Learned, Random, shapes
from baselines.hierarchical.safety import speed_limit, with_braking
from benchmark.control.arbitration import can_stop, held_by_conflict
from benchmark.control.controller import Command, Drive, Go
from benchmark.control.state import TrafficState, Vehicle
from benchmark.learning.observation import Numbers, Observer
from benchmark.world.world import World


@pytest.mark.parametrize(
    ("distance", "limit"),
    [
        (0.0, 0.0),
        (5.0, 0.0),
        (math.nextafter(5.0, 6.0), 1.0),
        (10.0, 1.0),
        (math.nextafter(10.0, 11.0), 2.0),
        (20.0, 2.0),
        (math.nextafter(20.0, 21.0), 3.0),
        (30.0, 3.0),
        (math.nextafter(30.0, 31.0), math.inf),
        (100.0, math.inf),
    ],
)
def test_the_limits_and_their_edges_are_the_papers(distance: float, limit: float) -> None:
    assert speed_limit(distance) == limit


distances, speeds = st.floats(0.0, 60.0), st.floats(0.0, 30.0)
accelerations = st.floats(-CAR.deceleration, CAR.acceleration)


@given(distances, speeds, accelerations, st.sampled_from([0.1, 0.5, 1.0]))
def test_whoever_is_above_the_limit_brakes_until_it_is_kept(
    distance: float, speed: float, wanted: float, step: float
) -> None:
    found = with_braking(vehicle(distance=distance, speed=speed), wanted, step)
    assert -CAR.deceleration <= found <= wanted
    after = speed + found * step
    if after > speed_limit(distance) + 1e-9:
        assert found == -CAR.deceleration
    elif found != wanted:
        assert after == pytest.approx(speed_limit(distance), abs=1e-9)


@given(distances, speeds)
def test_the_limit_never_rises_towards_the_entrance(distance: float, nearer: float) -> None:
    assert speed_limit(min(distance, nearer)) <= speed_limit(distance)


def test_the_low_level_sees_wangs_numbers_and_whether_rvs_are_on_the_lanes_beside() -> None:
    ego = vehicle("ego", lane="northbound_1")
    others = [
        vehicle("left", lane="northbound_2", distance=70.0),
        vehicle("right", "N-R", lane="northbound_0", is_robot=False),
    ]
    seen = state(ego, *others)
    found = LateralObserver(CROSSROADS).observe(seen, [ego])
    assert found.shape == (1, SIZE) == (1, 99)
    assert (found[:, :97] == Observer(CROSSROADS, "paper").observe(seen, [ego])).all()
    assert found[0, 97:].tolist() == [1.0, 0.0]


def test_a_lane_that_is_not_there_is_not_led() -> None:
    ego = vehicle("ego", "N-L", lane="northbound_3")
    seen = state(ego, vehicle("beside", lane="northbound_2"))
    assert LateralObserver(CROSSROADS).observe(seen, [ego])[0, 97:].tolist() == [0.0, 1.0]


def test_random_actions_are_repeatable_and_fill_the_range() -> None:
    egos = [vehicle("ego")] * 500
    seen = state(*egos)
    found = Random(3)(seen, egos)
    assert (found == Random(3)(seen, egos)).all()
    assert (found != Random(4)(seen, egos)).any()
    assert found.min() < -0.9
    assert found.max() > 0.9


def test_a_learned_action_is_the_clipped_mean() -> None:
    arrays: dict[str, Numbers] = {
        "hidden.0.weight": np.zeros((3, SIZE), dtype=np.float32),
        "hidden.0.bias": np.full(3, 9.0, dtype=np.float32),
        "action.weight": np.array([[1.0, 1.0, 1.0], [0.1, 0.1, 0.0]], dtype=np.float32),
        "action.bias": np.zeros(2, dtype=np.float32),
    }
    egos = [vehicle("one"), vehicle("two")]
    found = Learned(arrays, LateralObserver(CROSSROADS))(state(*egos), egos)
    assert found.tolist() == [pytest.approx([1.0, 0.2], abs=1e-6)] * 2
    assert {name: one.shape for name, one in arrays.items()} == shapes(SIZE, [3])


def asked(actions: list[float], seen: Any, **options: Any) -> dict[str, Command]:
    """What a hierarchy commands whose low level always answers the same."""
    found = Hierarchical(top="go", low="forward", **options)
    found.reset(CROSSROADS, seed=1)
    found.low_level = Always(actions)
    return dict(found.act(seen))


class Always:
    """A low level that always answers the same."""

    def __init__(self, actions: list[float]) -> None:
        self._actions = np.array(actions, dtype=np.float32)

    def __call__(self, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        return np.tile(self._actions, (len(egos), 1))


BLOCKED = crossing("E-C", cell=3)


def test_go_enters_and_a_go_that_would_be_held_back_is_driven_by_the_low_level() -> None:
    rv = vehicle(distance=25.0, speed=1.0)
    assert asked([1.0, 0.0], state(rv)) == {rv.id: Go()}
    assert asked([0.5, 0.0], state(rv, BLOCKED)) == {rv.id: Drive(0.5 * CAR.acceleration, 0)}
    assert asked([-1.0, 0.0], state(rv, BLOCKED)) == {rv.id: Drive(-CAR.deceleration, 0)}


def test_who_cannot_stop_any_more_goes() -> None:
    rv = vehicle(distance=2.0, speed=9.0)
    assert asked([1.0, 0.0], state(rv, BLOCKED)) == {rv.id: Go()}


def test_the_zones_brake_whatever_the_low_level_wants_unless_they_are_off() -> None:
    rv = vehicle(distance=25.0, speed=5.0)
    assert asked([1.0, 0.0], state(rv, BLOCKED)) == {rv.id: Drive(-2.0, 0)}
    assert asked([1.0, 0.0], state(rv, BLOCKED), zones=False) == {rv.id: Drive(CAR.acceleration, 0)}


@pytest.mark.parametrize(
    ("lane", "lane_change", "side"),
    [
        ("northbound_1", -0.34, 1),  # below -0.33: to the left
        ("northbound_1", -0.33, 0),
        ("northbound_1", 0.34, 0),  # the lane to the right is for right turns
        ("northbound_2", 0.34, -1),  # above 0.33: to the right
        ("northbound_2", 0.33, 0),
        ("northbound_2", -1.0, 0),  # the lane to the left is for left turns
    ],
)
def test_lane_changes_have_the_papers_thresholds_and_lead_where_the_movement_is_served(
    lane: str, lane_change: float, side: int
) -> None:
    rv = vehicle(distance=25.0, speed=1.0, lane=lane)
    for options, wanted in (({}, side), ({"lateral": False}, 0)):
        (command,) = asked([0.0, lane_change], state(rv, BLOCKED), **options).values()
        assert isinstance(command, Drive)
        assert command.lane_change == wanted


def test_driving_on_is_full_acceleration_in_the_own_lane() -> None:
    egos = [vehicle("one"), vehicle("two")]
    assert Forward()(state(*egos), egos).tolist() == [[1.0, 0.0]] * 2


@pytest.mark.parametrize("seed", [1001, 1002])
def test_every_rv_that_enters_was_cleared_when_it_could_still_stop(seed: int) -> None:
    controller = Hierarchical(low="random")
    world = World(smoke("crossing"), 0.7, seed, controller="hierarchical")
    ((name, site),) = world.sites.items()
    controller.reset(site.junction.intersection, seed)
    entered, cleared = 0, set[str]()
    before: TrafficState | None = None
    with world:
        while not world.over:
            seen = world.step()[name]
            for one in seen.inside:
                if before is None or all(one.id != ego.id for ego in before.deciding):
                    continue  # an HV, or one that was inside already
                entered += 1
                assert one.id in cleared
            commands = controller.act(seen)
            cleared = {
                ego.id
                for ego in seen.deciding
                if (commands[ego.id] == Go() and not held_by_conflict(seen, ego.movement))
                or (ego.id in cleared and not can_stop(ego))
            }
            world.carry_out(name, site.rules.decide(seen, commands), seen.time)
            before = seen
    assert entered > 10

"""What an RV observes, number by number; the same in training and in an episode."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from factories.scenarios import network_of, smoke
from factories.traffic import CROSSROADS, crossing, state, vehicle
from hypothesis import given
from hypothesis import strategies as st

from baselines.wang.controller import Wang
from baselines.wang.policy import Greedy
from benchmark.control import plugins
from benchmark.control.controller import Command, Controller, Go
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState, Vehicle
from benchmark.learning.observation import MOVEMENTS, Layout, Numbers, Observer, size
from benchmark.learning.traffic import GO, Traffic
from benchmark.study.episode import Episode, run_episode

PAPER, EXTENDED = Observer(CROSSROADS, "paper"), Observer(CROSSROADS, "extended")
QUEUE, WAITING, OCCUPANCY, DISTANCE = slice(0, 8), slice(8, 16), slice(16, 96), 96
VEHICLES, ROBOTS, STANDING = slice(97, 105), slice(105, 113), slice(113, 121)
EGO = slice(121, 126)

ego = vehicle("ego", "E-C", distance=12.0)


def test_the_papers_layout_has_97_numbers_and_the_extended_one_29_more() -> None:
    assert (size("paper"), size("extended")) == (97, 126)
    assert PAPER.observe(state(ego), [ego]).shape == (1, 97)
    assert EXTENDED.observe(state(ego), [ego]).shape == (1, 126)
    assert EXTENDED.observe(state(), []).shape == (0, 126)


def test_an_rv_alone_sees_only_its_distance() -> None:
    (seen,) = PAPER.observe(state(ego), [ego])
    assert seen[DISTANCE] == pytest.approx(12 / 30)
    assert not seen[:DISTANCE].any()


@pytest.mark.parametrize("own", MOVEMENTS)
def test_the_own_movement_comes_first_and_the_others_follow_clockwise_modulo_eight(
    own: str,
) -> None:
    first = MOVEMENTS.index(own)
    order = [MOVEMENTS[(first + step) % 8] for step in range(8)]
    me = vehicle("ego", own)
    waiting = [
        vehicle(name, name, speed=0.0, waiting=10.0 * (step + 1))
        for step, name in enumerate(order)
        if step
    ]
    inside = [crossing(name, cell=step) for step, name in enumerate(order)]
    (seen,) = PAPER.observe(state(me, *waiting, *inside), [me])
    assert seen[QUEUE].tolist() == [0, 1, 1, 1, 1, 1, 1, 1]
    expected = [0, *(10.0 * (step + 1) / 200 for step in range(1, 8))]
    assert seen[WAITING].tolist() == pytest.approx(expected)
    assert np.array_equal(seen[OCCUPANCY].reshape(8, 10), np.eye(8, 10))


@given(
    st.lists(
        st.tuples(st.sampled_from(MOVEMENTS), st.floats(0, 0.2), st.floats(0, 300), st.booleans()),
        max_size=20,
    ),
    st.lists(
        st.tuples(st.sampled_from(MOVEMENTS), st.integers(0, 9), st.floats(0, 0.2)), max_size=10
    ),
)
def test_turned_back_to_one_point_of_view_all_eight_egos_see_the_same(
    traffic: list[tuple[str, float, float, bool]], inside: list[tuple[str, int, float]]
) -> None:
    now = state(
        *(
            vehicle(str(i), name, speed=speed, waiting=waiting, is_robot=robot)
            for i, (name, speed, waiting, robot) in enumerate(traffic)
        ),
        *(crossing(name, cell)._replace(speed=speed) for name, cell, speed in inside),
    )
    seen = EXTENDED.observe(now, [vehicle(name, name) for name in MOVEMENTS])
    for block in (QUEUE, WAITING, OCCUPANCY, VEHICLES, ROBOTS, STANDING):
        by_movement = seen[:, block].reshape(8, 8, -1)  # (egos, movements, numbers)
        for index, one in enumerate(by_movement):
            assert np.array_equal(np.roll(one, index, axis=0), by_movement[0])


def test_queues_are_seen_as_shares_of_the_longest() -> None:
    queues = {"E-C": 1, "N-L": 4, "W-C": 2}
    others = [
        vehicle(f"{name}.{index}", name, speed=0.05, is_robot=False)
        for name, count in queues.items()
        for index in range(count)
    ]
    (seen,) = PAPER.observe(state(ego, *others), [ego])
    by_name = dict(zip([*MOVEMENTS[3:], *MOVEMENTS[:3]], seen[QUEUE].tolist(), strict=True))
    assert {name: value for name, value in by_name.items() if value} == {
        "E-C": 0.25,
        "N-L": 1.0,
        "W-C": 0.5,
    }


@pytest.mark.parametrize(("speed", "stands"), [(0.099, True), (0.1, False)])
def test_only_vehicles_that_stand_are_in_a_queue(speed: float, stands: bool) -> None:
    (seen,) = PAPER.observe(state(ego, vehicle("a", "N-C", speed=speed)), [ego])
    assert bool(seen[QUEUE].any()) is stands


def test_waiting_is_the_movements_mean_over_200_s_and_at_most_one() -> None:
    long = [vehicle("a", "E-C", waiting=300.0), vehicle("b", "E-C", waiting=500.0)]
    me = vehicle("ego", "E-C", waiting=10.0)
    (seen,) = PAPER.observe(state(me, vehicle("a", "E-C", waiting=30.0)), [me])
    assert seen[WAITING][0] == pytest.approx(20 / 200)
    (seen,) = PAPER.observe(state(me, *long), [me])
    assert seen[WAITING][0] == 1.0


def test_right_turns_are_not_seen() -> None:
    turning = [vehicle("a", "N-R", speed=0.0, waiting=50.0), crossing("S-R", cell=3)]
    for observer in (PAPER, EXTENDED):
        (seen,) = observer.observe(state(ego, *turning), [ego])
        (empty,) = observer.observe(state(ego), [ego])
        assert np.array_equal(seen, empty)


def test_movements_that_a_three_legged_intersection_lacks_are_zeros() -> None:
    (junction,) = network_of("smoke/tee").junctions.values()
    tee = junction.intersection
    lacking = [name for name in MOVEMENTS if name not in tee.movements]
    assert lacking
    for own in tee.regulated_movements:
        lane = tee.movements[own].lanes[0]
        me = vehicle("ego", own, lane=lane, speed=0.0, waiting=20.0)
        others = [
            vehicle(name, name, lane=tee.movements[name].lanes[0], speed=0.0, waiting=20.0)
            for name in tee.regulated_movements
            if name != own
        ]
        (seen,) = Observer(tee, "extended").observe(state(me, *others, where=tee), [me])
        order = [MOVEMENTS[(MOVEMENTS.index(own) + step) % 8] for step in range(8)]
        for block in (QUEUE, WAITING, VEHICLES, ROBOTS):
            absent = [name for name, value in zip(order, seen[block], strict=True) if value == 0]
            assert sorted(absent) == sorted(lacking)


def test_the_extended_layout_adds_load_and_who_stands_inside() -> None:
    others = [vehicle(str(i), "W-L", is_robot=i < 2, distance=60.0) for i in range(6)]
    stuck = [crossing("E-C", 2, "a")._replace(speed=0.0), crossing("N-C", 1, "b")]
    (seen,) = EXTENDED.observe(state(ego, *others, *stuck), [ego])
    west = (MOVEMENTS.index("W-L") - MOVEMENTS.index("E-C")) % 8
    assert seen[VEHICLES][[0, west]].tolist() == pytest.approx([1 / 40, 6 / 40])
    assert seen[ROBOTS][[0, west]].tolist() == pytest.approx([1 / 40, 2 / 40])
    assert seen[STANDING].tolist() == [0.25, 0, 0, 0, 0, 0, 0, 0]


def test_the_extended_layout_adds_the_egos_turn_speed_waiting_and_whether_it_is_held_back() -> None:
    me = vehicle("ego", "S-L", speed=4.0, waiting=50.0, held_back=True)
    (seen,) = EXTENDED.observe(state(me), [me])
    assert seen[EGO].tolist() == pytest.approx([1, 4 / 20, 50 / 200, 1, 0])
    me = vehicle("ego", "S-C", speed=4.0)
    (seen,) = EXTENDED.observe(state(me, crossing("E-C", 1)), [me])
    assert seen[EGO].tolist() == pytest.approx([0, 4 / 20, 0, 0, 1])


def test_egos_of_one_moment_see_it_each_from_their_side() -> None:
    egos = [vehicle(name, name, speed=0.0, distance=5.0 + i) for i, name in enumerate(MOVEMENTS)]
    together = EXTENDED.observe(state(*egos), egos)
    alone = [EXTENDED.observe(state(*egos), [one])[0] for one in egos]
    assert np.array_equal(together, np.stack(alone))


@given(
    st.lists(
        st.tuples(
            st.sampled_from(MOVEMENTS),
            st.floats(0, 100),
            st.floats(0, 30),
            st.floats(0, 1000),
            st.booleans(),
        ),
        max_size=20,
    ),
    st.lists(st.tuples(st.sampled_from(MOVEMENTS), st.integers(0, 9)), max_size=10),
    st.sampled_from(["paper", "extended"]),
)
def test_every_number_lies_between_0_and_1(
    traffic: list[tuple[str, float, float, float, bool]],
    inside: list[tuple[str, int]],
    layout: Layout,
) -> None:
    vehicles = [
        vehicle(str(i), name, distance=d, speed=v, waiting=w, is_robot=robot)
        for i, (name, d, v, w, robot) in enumerate(traffic)
    ]
    now = state(*vehicles, *(crossing(name, cell) for name, cell in inside))
    seen = Observer(CROSSROADS, layout).observe(now, now.deciding)
    assert seen.dtype == np.float32
    assert ((seen >= 0) & (seen <= 1)).all()


def test_training_and_an_episode_observe_the_same_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario, seen = smoke("crossing"), []

    class Watcher(Controller):
        """Go, and note what is observed."""

        def reset(self, intersection: Intersection, seed: int) -> None:
            self._observer = Observer(intersection, "extended")

        def act(self, state: TrafficState) -> Mapping[str, Command]:
            seen.append(self._observer.observe(state, state.deciding))
            return {one.id: Go() for one in state.deciding}

    monkeypatch.setattr(plugins, "load_class", lambda name: Watcher)
    assert run_episode(Episode(scenario, "first-come", 0.6, 1001)).status == "ok"
    with Traffic(scenario, 0.6, 1001, layout="extended", gridlock_after=1e9) as traffic:
        moment = traffic.first()
        learnt = [moment.observations]
        while not moment.over:
            moment = traffic.step({one.id: GO for one in moment.egos})
            learnt.append(moment.observations)
    assert sum(len(one) for one in seen) > 50
    assert len(seen) == len(learnt)
    assert all(np.array_equal(a, b) for a, b in zip(seen, learnt, strict=True))


def test_the_shipped_controller_sees_in_an_episode_what_it_sees_in_training(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario, observe = smoke("crossing"), Observer.observe
    rows: dict[tuple[float, str], Numbers] = {}

    def noted(self: Observer, state: TrafficState, egos: Sequence[Vehicle]) -> Numbers:
        seen = observe(self, state, egos)
        rows.update({(state.time, ego.id): row for ego, row in zip(egos, seen, strict=True)})
        return seen

    monkeypatch.setattr(Observer, "observe", noted)
    assert run_episode(Episode(scenario, "wang", 0.6, 1001)).status == "ok"
    asked, rows = rows, {}
    policy = Greedy(Wang()._weights.arrays)
    with Traffic(scenario, 0.6, 1001, layout=Wang.LAYOUT, gridlock_after=1e9) as traffic:
        moment = traffic.first()
        while not moment.over:
            actions = {}
            if moment.egos:
                chosen = policy(moment.observations).tolist()
                actions = dict(zip([ego.id for ego in moment.egos], chosen, strict=True))
            moment = traffic.step(actions)
    assert len(asked) > 50
    assert all(np.array_equal(row, rows[when_and_who]) for when_and_who, row in asked.items())


def test_the_zones_length_is_the_scenarios() -> None:
    wide = Observer(replace(CROSSROADS, decision_zone=60.0), "paper")
    (seen,) = wide.observe(state(ego), [ego])
    assert seen[DISTANCE] == pytest.approx(12 / 60)

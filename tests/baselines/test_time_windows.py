"""Time windows: each piece alone, and the rule's promises on any traffic."""

import math
import random
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from factories.scenarios import PAPER, network_of, shipped, smoke
from factories.traffic import CAR, drawn, state, vehicle
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines.time_windows import drawing
from baselines.time_windows.analysis import shares
from baselines.time_windows.controller import TimeWindows
from baselines.time_windows.lane_changes import lane_changes
from baselines.time_windows.prediction import PASSED, Passage, Predictor
from baselines.time_windows.queues import MARGIN, Platoon, Queue, can_stop, survey
from baselines.time_windows.ranking import Ranking, RankWeights
from baselines.time_windows.reservations import Ledger, Margins
from baselines.time_windows.stretches import SPACING, lane_conflicts, movement_conflicts
from baselines.time_windows.watched import watched
from benchmark.control import plugins
from benchmark.control.controller import Drive
from benchmark.control.intersection import Way
from benchmark.control.state import Crossing, TrafficState, Vehicle
from benchmark.plumbing.errors import ControllerError, UsageError
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import all_episodes

WHERE = drawn()
CONFLICTS = lane_conflicts(WHERE, 2.8)
INDEX = {way.lane: index for index, way in enumerate(CONFLICTS.ways)}
KEYS = {(CONFLICTS.movements[i], lane): i for lane, i in INDEX.items()}
PREDICTOR = Predictor(CONFLICTS, acceleration=2.0, headway=1.3, creeping=3.0, creeping_delay=4.0)
MARGINS = Margins(after=1.4, before=2.0, growth=0.05, look_ahead=10.0, yielding=2.0)
WEIGHTS = RankWeights(
    *(0.1, 60.0),  # waiting, up to
    *(6.0, 4.0),  # flowing, joining
    *(20.0, 4.0),  # green, gap
    180.0,  # patience
)


def here(*who: Vehicle | Crossing, time: float = 0.0) -> TrafficState:
    found: TrafficState = state(*who, time=time, where=WHERE)
    return found


def inside(movement: str, name: str = "hv", **facts: Any) -> Crossing:
    way = WHERE.movements[movement].ways[0]
    settled = {"position": 2.0, "speed": 8.0, "is_robot": False, **facts}
    return Crossing(
        id=name, movement=movement, lane=way.lane, way_length=way.length, body=CAR, **settled
    )


def way(*points: tuple[float, float], lane: str = "lane") -> Way:
    length = float(np.hypot(*np.diff(np.array(points), axis=0).T).sum())
    return Way(lane, f"exit of {lane}", length, 13.89, points)


@given(angle=st.floats(math.radians(25), math.radians(155)), clearance=st.floats(1.0, 4.0))
def test_the_stretch_of_two_straight_ways_is_where_they_are_closer_than_the_clearance(
    angle: float, clearance: float
) -> None:
    reach = 30.0
    tip = (reach * math.cos(angle), reach * math.sin(angle))
    one, other = way((-reach, 0.0), (reach, 0.0)), way((-tip[0], -tip[1]), tip)
    movements = dict(WHERE.movements)
    movements["N-C"] = replace(movements["N-C"], ways=(one,))
    movements["E-C"] = replace(movements["E-C"], ways=(other,))
    chosen = {name: movements[name] for name in ("N-C", "E-C")}
    found = lane_conflicts(replace(WHERE, movements=chosen), clearance)
    half = clearance / math.sin(angle)
    for pair in ((0, 1), (1, 0)):
        assert found.start[pair] == pytest.approx(reach - half, abs=1.5 * SPACING)
        assert found.end[pair] == pytest.approx(reach + half, abs=1.5 * SPACING)


def test_ways_of_one_approach_and_ways_apart_share_no_stretch() -> None:
    for one, other in (("northbound_2", "northbound_3"), ("northbound_1", "southbound_1")):
        assert np.isnan(CONFLICTS.start[INDEX[one], INDEX[other]])
    assert CONFLICTS.start[INDEX["northbound_1"], INDEX["eastbound_1"]] > 0


@pytest.mark.parametrize("name", PAPER)
def test_on_the_shipped_networks_stretches_are_mutual_and_lie_on_their_ways(name: str) -> None:
    (junction,) = network_of(name).junctions.values()
    found = lane_conflicts(junction.intersection, 2.8)
    meets = ~np.isnan(found.start)
    assert (meets == meets.T).all()
    assert (meets == ~np.isnan(found.end)).all()
    lengths = np.array([way.length for way in found.ways])[:, None]
    assert (found.start[meets] >= 0).all()
    assert (found.end <= lengths + 1e-9)[meets].all()
    assert (found.start < found.end)[meets].all()
    crossing_pairs = [
        (i, j)
        for i, one in enumerate(found.movements)
        for j, other in enumerate(found.movements)
        if {one[0], other[0]} in ({"N", "E"}, {"S", "W"}) and one[2] == other[2] == "C"
    ]
    assert crossing_pairs
    assert all(meets[pair] for pair in crossing_pairs)


def test_stretches_are_found_once_for_each_network() -> None:
    again = lane_conflicts(drawn(), 2.8)
    assert again.start is CONFLICTS.start


def test_movement_conflicts_are_whole_ways_of_conflicting_movements() -> None:
    found = movement_conflicts(WHERE)
    north, east, south = (INDEX[lane] for lane in ("northbound_1", "eastbound_1", "southbound_1"))
    assert (found.start[north, east], found.end[north, east]) == (0.0, found.ways[north].length)
    assert np.isnan(found.start[north, south])


def driven(distance: float, speed: float, fastest: float, acceleration: float = 2.0) -> float:
    """Time for a distance, step by tiny step."""
    time, step = 0.0, 1e-3
    while distance > 0:
        faster = min(fastest, speed + acceleration * step)
        distance -= (speed + faster) / 2 * step
        speed, time = faster, time + step
    return time


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 60.0), st.floats(0.5, 13.0))
def test_vehicles_speed_up_to_the_limit_and_keep_it(distance: float, speed: float) -> None:
    seen = vehicle(distance=distance, speed=speed)
    passage = PREDICTOR.approaching(seen, INDEX[seen.lane], None)
    assert passage.time == pytest.approx(driven(distance, speed, 13.89), abs=0.01)
    windows = PREDICTOR.windows([passage])
    start, end = (edge[INDEX[seen.lane]] for edge in (CONFLICTS.start, CONFLICTS.end))
    meets = np.flatnonzero(~np.isnan(start))
    assert np.isnan(windows.enter[0]).sum() == len(start) - len(meets)
    for j in meets:
        enters, leaves = distance + start[j], distance + end[j] + CAR.length
        assert windows.enter[0, j] == pytest.approx(driven(enters, speed, 13.89), abs=0.02)
        assert windows.leave[0, j] == pytest.approx(driven(leaves, speed, 13.89), abs=0.02)


def test_nobody_drives_faster_than_its_body_can() -> None:
    slow = vehicle(distance=40.0, speed=5.0, body=CAR._replace(maximum_speed=5.0))
    assert PREDICTOR.approaching(slow, 0, None).time == pytest.approx(8.0)


def test_a_follower_comes_a_headway_later_at_the_earliest() -> None:
    first = PREDICTOR.approaching(vehicle(distance=20.0, speed=0.0), 0, None)
    second = PREDICTOR.approaching(vehicle(distance=21.0, speed=13.0), 0, first)
    assert second.time == first.time + PREDICTOR.headway


def test_a_stretch_that_lies_behind_is_passed_and_who_creeps_may_leave_later() -> None:
    movement = "N-C"
    index = INDEX[WHERE.movements[movement].ways[0].lane]
    length = CONFLICTS.ways[index].length
    beyond = PREDICTOR.inside(inside(movement, position=length + CAR.length), index)
    assert np.nanmax(PREDICTOR.windows([beyond]).leave) == PASSED
    fast, creeping = (
        PREDICTOR.windows([PREDICTOR.inside(inside(movement, speed=speed), index)])
        for speed in (3.0, 2.9)
    )
    later = np.nanmin(creeping.leave - fast.leave)
    assert 4.0 <= later < 4.5


passages = st.lists(
    st.builds(
        Passage,
        id=st.just("one"),
        way=st.integers(0, len(CONFLICTS.ways) - 1),
        time=st.floats(0.0, 12.0),
        origin=st.just(0.0),
        speed=st.floats(0.0, 13.0),
        fastest=st.just(13.89),
        length=st.floats(3.0, 15.0),
        delay=st.just(0.0),
        yields=st.just(False),
    ),
    min_size=2,
    max_size=12,
)
margins = st.builds(
    Margins,
    after=st.floats(0.0, 3.0),
    before=st.floats(0.0, 3.0),
    growth=st.floats(0.0, 0.2),
    look_ahead=st.just(10.0),
    yielding=st.floats(0.0, 4.0),
)


@given(passages, margins)
def test_two_accepted_vehicles_never_hold_overlapping_windows_on_one_stretch(
    who: list[Passage], kept: Margins
) -> None:
    windows = PREDICTOR.windows(who)
    ledger = Ledger(windows, kept)
    accepted = []
    for index in range(len(who)):
        if ledger.free(index):
            ledger.reserve(1 << index)
            accepted.append(index)
    assert accepted[0] == 0
    for one in accepted:
        for other in accepted:
            a, b = windows.ways[one], windows.ways[other]
            if one != other and not math.isnan(CONFLICTS.start[a, b]):
                earlier = windows.leave[one, b] < windows.enter[other, a]
                later = windows.leave[other, a] < windows.enter[one, b]
                assert earlier or later or kept.after == 0 or kept.before == 0


@given(passages, margins, st.data())
def test_greater_margins_free_nobody(who: list[Passage], kept: Margins, data: Any) -> None:
    name = data.draw(st.sampled_from(["after", "before", "growth"]))
    wider = kept._replace(**{name: getattr(kept, name) + data.draw(st.floats(0.0, 2.0))})
    narrow, wide = (Ledger(PREDICTOR.windows(who), one) for one in (kept, wider))
    for ledger in (narrow, wide):
        ledger.reserve(0b1)
    assert all(narrow.free(i) for i in range(1, len(who)) if wide.free(i))


def passage(lane: str, time: float, **facts: Any) -> Passage:
    settled = {"origin": 0.0, "speed": 8.0, "fastest": 13.89, "length": 5.0, "delay": 0.0}
    return Passage(id=lane, way=INDEX[lane], time=time, **{**settled, "yields": False, **facts})


def ledger(*who: Passage, **margins: float) -> Ledger:
    return Ledger(PREDICTOR.windows(who), MARGINS._replace(**margins))


def test_one_passes_ahead_or_behind_but_not_between() -> None:
    for time, free in ((-6.0, True), (0.0, False), (6.0, True)):
        of = ledger(passage("northbound_1", 8.0), passage("eastbound_1", 8.0 + time))
        of.reserve(0b01)
        assert of.free(1) is free


def test_an_hv_that_comes_later_yields() -> None:
    for later, free in ((1.0, False), (2.5, True)):
        of = ledger(passage("northbound_1", later, yields=True), passage("eastbound_1", 0.0))
        of.reserve(0b01)
        assert of.free(1) is free


def test_a_booked_slot_is_kept_free_for_its_vehicle() -> None:
    who = [passage(lane, 0.0) for lane in ("northbound_1", "eastbound_1", "westbound_1")]
    of = ledger(*who, growth=0.0)
    of.reserve(0b001)
    delay = of.book(1, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert delay is not None
    moved = ledger(who[0], who[1]._replace(time=delay), growth=0.0)
    moved.reserve(0b01)
    assert moved.free(1)
    sooner = ledger(who[0], who[1]._replace(time=delay - 1.0), growth=0.0)
    sooner.reserve(0b01)
    assert not sooner.free(1)
    blocker = passage("southbound_1", delay)
    of = ledger(*who, blocker, growth=0.0)
    of.reserve(0b0001)
    assert of.free(3)
    assert of.book(1, [delay]) == delay
    assert not of.free(3)


def test_no_slot_is_booked_where_none_is_free() -> None:
    who = [passage("northbound_1", time) for time in (0.0, 2.0, 4.0, 6.0)]
    of = ledger(*who, passage("eastbound_1", 1.0))
    of.reserve(0b1111)
    assert of.book(4, [1.0, 2.0, 3.0]) is None


def test_everybody_whose_way_meets_makes_way() -> None:
    lanes = ("northbound_1", "eastbound_1", "southbound_1")
    of = ledger(*(passage(lane, 30.0 * i) for i, lane in enumerate(lanes)))
    of.clear_the_way(0)
    assert [of.free(i) for i in range(3)] == [True, False, True]


def test_platoons_begin_with_rvs_that_can_stop_and_whoever_cannot_is_committed() -> None:
    lane = "northbound_1"
    who = [
        vehicle("hv ahead", lane=lane, distance=5.0, is_robot=False),
        vehicle("rv", lane=lane, distance=20.0),
        vehicle("hv", lane=lane, distance=30.0, is_robot=False),
        vehicle("rv behind", lane=lane, distance=40.0),
        vehicle("too fast", "E-C", lane="eastbound_1", distance=4.0, speed=13.0),
        vehicle("turns right", "E-R", lane="eastbound_0", distance=10.0),
        vehicle("far", "S-C", lane="southbound_1", distance=98.0, speed=0.0),
    ]
    found = survey(here(*who, inside("W-C", "inside")), KEYS, PREDICTOR, look_ahead=10.0)
    names = [one.id for one in found.passages]
    committed = {name for i, name in enumerate(names) if found.committed >> i & 1}
    assert committed == {"inside", "hv ahead", "too fast"}
    platoons = {queue.lane: queue.platoons for queue in found.queues}
    assert [one.leader.id for one in platoons[lane]] == ["rv", "rv behind"]
    assert [[names[i] for i in one.followers] for one in platoons[lane]] == [["hv"], []]
    assert platoons["eastbound_1"] == platoons["southbound_1"] == []
    assert "turns right" not in names
    assert "far" not in names


@given(st.floats(0.1, 60.0), st.floats(0.0, 15.0))
def test_who_can_stop_stops_before_the_line_by_braking_hard(distance: float, speed: float) -> None:
    can = can_stop(vehicle(distance=distance, speed=speed), 1.0)
    left = distance
    while speed > 0:
        speed = max(0.0, speed - CAR.deceleration)
        left -= speed
    assert left > 0 or not can
    assert can or left < MARGIN + CAR.deceleration  # no more is lost than whole steps cost


def queue(lane: str, movement: str, *, count: int = 1, waiting: float = 0.0) -> Queue:
    who = [
        vehicle(f"{lane}.{i}", movement, lane=lane, distance=5.0 + 8 * i, waiting=waiting)
        for i in range(count)
    ]
    return Queue(lane, who, [Platoon(who[0], 0)])


def order(ranking: Ranking, *queues: Queue, time: float = 0.0) -> list[str]:
    found = [one.lane for one in ranking.order(queues, time)]
    assert [one.lane for one in ranking.order(reversed(queues), time)] == found
    return found


NORTH = queue("northbound_1", "N-C")
EAST = queue("eastbound_1", "E-C", count=2)
SOUTH = queue("southbound_1", "S-C")


def test_more_vehicles_rank_higher_and_waiting_counts_up_to_a_bound() -> None:
    of = Ranking(WHERE, WEIGHTS)
    assert order(of, NORTH, EAST, SOUTH) == ["eastbound_1", "northbound_1", "southbound_1"]
    waited = queue("northbound_1", "N-C", waiting=15.0)
    assert order(of, waited, EAST)[0] == "northbound_1"
    assert of.rank(queue("x", "N-C", waiting=60.0), 0.0) == of.rank(
        queue("x", "N-C", waiting=900.0), 0.0
    )


def test_what_flows_goes_on_until_its_green_ends_or_nobody_comes() -> None:
    of = Ranking(WHERE, WEIGHTS)
    of.remember(NORTH.vehicles, [], 0.0)
    assert order(of, NORTH, EAST, SOUTH, time=1.0) == [
        *("northbound_1", "southbound_1", "eastbound_1"),  # flows, joins, conflicts
    ]
    for time in range(1, 20):
        of.remember(NORTH.vehicles, [], float(time))
    assert order(of, NORTH, EAST, time=19.0)[0] == "northbound_1"
    assert order(of, NORTH, EAST, time=20.0)[0] == "eastbound_1"
    of.remember([], [], 24.0)
    assert order(of, NORTH, EAST, time=24.0)[0] == "eastbound_1"


def test_a_movement_flows_no_more_after_a_gap() -> None:
    of = Ranking(WHERE, WEIGHTS)
    of.remember(NORTH.vehicles, [], 0.0)
    of.remember([], [], 4.5)
    assert order(of, NORTH, EAST, time=4.5)[0] == "eastbound_1"


def test_a_lane_whose_first_rv_was_refused_for_long_comes_first() -> None:
    of = Ranking(WHERE, WEIGHTS._replace(patience=10.0))
    for time in range(12):
        of.remember([], NORTH.vehicles, float(time))
    assert not of.overdue(NORTH, 10.0)
    assert of.overdue(NORTH, 11.0)
    assert order(of, NORTH, EAST, time=11.0)[0] == "northbound_1"
    of.remember(NORTH.vehicles, [], 12.0)
    assert not of.overdue(NORTH, 100.0)


def changes(*who: Vehicle, nearest: float = 20.0, gap: float = 8.0) -> dict[str, int]:
    lanes: dict[str, list[Vehicle]] = {}
    for one in sorted(who, key=lambda one: one.distance):
        lanes.setdefault(one.lane, []).append(one)
    queues = [Queue(lane, lanes[lane]) for lane in sorted(lanes)]
    found = list(lane_changes(WHERE, queues, (), nearest, gap))
    return {one.id: side for one, side in found}


FIRST = vehicle("first", lane="northbound_1", distance=20.0)
SECOND = vehicle("second", lane="northbound_1", distance=40.0)


def test_an_rv_behind_an_rv_goes_to_lead_the_next_lane_of_its_movement() -> None:
    assert changes(FIRST, SECOND) == {"second": 1}
    mirrored = [one._replace(lane="northbound_2") for one in (FIRST, SECOND)]
    assert changes(*mirrored) == {"second": -1}


@pytest.mark.parametrize(
    "other",
    [
        vehicle("leads", lane="northbound_2", distance=25.0),
        vehicle("beside", lane="northbound_2", distance=45.0, is_robot=False),
    ],
)
def test_but_not_where_an_rv_leads_already_or_there_is_no_room(other: Vehicle) -> None:
    assert changes(FIRST, SECOND, other) == {}


def test_nor_close_to_the_entrance_nor_from_where_its_movement_is_not_served() -> None:
    near = [FIRST._replace(distance=5.0), SECOND._replace(distance=19.0)]
    assert changes(*near) == {}
    left = [
        one._replace(lane="northbound_3", movement="N-L", id=f"left {one.id}")
        for one in (FIRST, SECOND)
    ]
    assert changes(*left) == {}


def test_only_one_rv_goes_to_each_lane() -> None:
    third = vehicle("third", lane="northbound_1", distance=60.0)
    assert changes(FIRST, SECOND, third) == {"second": 1}


def ready(**options: Any) -> TimeWindows:
    found = TimeWindows(**options)
    found.reset(WHERE, seed=1)
    return found


@st.composite
def traffic(draw: st.DrawFn) -> TrafficState:
    """Any vehicles on any lanes, before the entrance and inside."""
    who: list[Vehicle | Crossing] = []
    for lane in WHERE.lanes.values():
        distance = 0.0
        for i in range(draw(st.integers(0, 3))):
            distance += draw(st.floats(0.5, 20.0)) + 5.0
            movement = draw(st.sampled_from(lane.movements))
            who.append(
                vehicle(
                    f"{lane.id}.{i}",
                    movement,
                    lane=lane.id,
                    distance=distance,
                    speed=draw(st.floats(0.0, 14.0)),
                    waiting=draw(st.floats(0.0, 100.0)),
                    is_robot=draw(st.booleans()),
                )
            )
    for movement in draw(st.lists(st.sampled_from(["N-C", "E-C", "W-L", "S-R"]), max_size=3)):
        position, speed = draw(st.floats(0.0, 30.0)), draw(st.floats(0.0, 14.0))
        name = f"inside.{len(who)}"
        who.append(inside(movement, name, position=position, speed=speed))
    return here(*who)


@settings(max_examples=40)
@given(traffic(), st.randoms(use_true_random=False))
def test_no_decision_depends_on_the_order_of_vehicles_or_lanes(
    seen: TrafficState, shuffler: random.Random
) -> None:
    def mixed(parts: Any) -> Any:
        return shuffler.sample(list(parts), len(parts))

    again = replace(seen, vehicles=tuple(mixed(seen.vehicles)), inside=tuple(mixed(seen.inside)))
    where = replace(
        WHERE,
        lanes=dict(mixed(WHERE.lanes.items())),
        movements=dict(mixed(WHERE.movements.items())),
    )
    other = TimeWindows()
    other.reset(where, seed=2)
    assert dict(ready().act(seen)) == dict(other.act(again))


@settings(max_examples=40)
@given(traffic())
def test_only_rvs_are_commanded_and_within_what_their_bodies_can(seen: TrafficState) -> None:
    who = {one.id: one for one in seen.vehicles}
    for name, command in ready().act(seen).items():
        assert who[name].is_robot
        assert isinstance(command, Drive)
        assert -CAR.deceleration <= command.acceleration <= CAR.acceleration


@settings(max_examples=30)
@given(st.floats(10.0, 90.0), st.floats(0.0, 13.8), st.floats(1.0, 4.0))
def test_a_refused_rv_stops_before_the_line(distance: float, speed: float, braking: float) -> None:
    rv = vehicle(distance=distance, speed=speed)
    if not can_stop(rv, 1.0):
        return
    of = ready(braking=braking)
    in_the_way = inside("E-C", position=4.0, speed=0.0)
    for time in range(60):
        command = of.act(here(rv, in_the_way, time=float(time))).get(rv.id)
        gain = command.acceleration if isinstance(command, Drive) else CAR.acceleration
        faster = min(13.89, max(0.0, rv.speed + gain))
        rv = rv._replace(speed=faster, distance=rv.distance - faster)
        assert rv.distance > 0
    assert rv.speed < 0.1
    assert rv.distance < 5.0


def test_nobody_is_refused_on_an_empty_road() -> None:
    assert ready().act(here(vehicle())) == {}
    assert ready().act(here()) == {}


@cache
def longest_refusal(patience: float) -> float:
    """For how long a lane's first RV was refused at worst, in much traffic [s]."""
    longest, since = 0.0, {}
    decide = TimeWindows.decide

    def noted(self: Any, state: TrafficState) -> Any:
        nonlocal longest, since
        found = decide(self, state)
        firsts = {q.platoons[0].leader.id for q in found.queues if q.platoons}
        refused = [one for one in found.refused if one.id in firsts]
        since = {one.id: since.get(one.id, state.time) for one in refused}
        longest = max([longest, *(state.time - begun for begun in since.values())])
        return found

    scenario = shipped("colorado-springs/334")
    evaluation = scenario.evaluation.model_copy(update={"duration": 200.0, "warm_up": 0.0})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TimeWindows, "decide", noted)
        run_episode(
            Episode(
                scenario.with_demand(1.6).with_evaluation(evaluation),
                f"time-windows?patience={patience:g}&flowing=50",
                1.0,
                1001,
            )
        )
    return longest


def test_nobody_starves() -> None:
    assert (
        20.0 <= longest_refusal(20.0) <= 20.0 + 60.0
    )  # lanes that are overdue take turns, each with clearing


def test_patience_is_what_bounds_it() -> None:
    assert longest_refusal(20.0) < longest_refusal(1000.0)


@pytest.mark.parametrize(
    "option",
    ["acceleration=0", "before=-1", "later_slots=-1", "later_slots=1.5", "after=nan", "green=inf"],
)
def test_options_that_make_no_sense_are_refused(option: str) -> None:
    with pytest.raises(ControllerError, match=option.partition("=")[0]):
        plugins.find_controller(f"time-windows?{option}")


@pytest.mark.parametrize(
    "reference",
    [
        "time-windows?stretches=movements",
        "time-windows?later_slots=0&growth=0.05",
        "time-windows?spread=false",
    ],
)
def test_every_variant_runs_without_a_collision(reference: str) -> None:
    (episode,) = all_episodes([smoke("crossing")], [reference], [0.6], [1001])
    record = run_episode(episode)
    assert record.status == "ok"
    assert record.trips is not None
    assert record.trips.collisions_with_robot == 0


def test_the_windows_of_a_conflict_are_drawn_from_an_episode(tmp_path: Path) -> None:
    target = tmp_path / "windows.png"
    drawing.draw(smoke("crossing"), 0.8, 1001, target)
    assert target.stat().st_size > 10_000
    found = watched(smoke("crossing"), 0.8, 1001)
    one, other, begin = drawing.busiest(found)
    assert not math.isnan(found.conflicts.start[one, other])
    assert begin in (0.0, 60.0)
    held = [v for v in found.passings.values() if v.windows and v.track[-1][1] > v.length]
    assert held
    for passing in held:  # who held windows passed at about that time
        for way, (enters, _) in passing.windows.items():
            stretch = found.conflicts.start[passing.way, way], found.conflicts.end[passing.way, way]
            assert abs(passing.on(stretch)[0] - enters) < 5.0


def test_there_is_nothing_to_draw_without_rvs(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="give a higher rate"):
        drawing.draw(smoke("crossing"), 0.0, 1001, tmp_path / "windows.png")


def test_the_analysis_counts_everybody_and_only_what_was_in_the_way() -> None:
    found = dict(shares(smoke("crossing"), 0.5, [1001, 1002]))
    entered = [share for name, share in found.items() if name.startswith("entered")]
    assert sum(entered) == pytest.approx(100)
    assert min(entered) > 0
    in_the_way = {name: share for name, share in found.items() if name.startswith("in the way")}
    assert in_the_way
    assert all(0 < share <= 100 for share in in_the_way.values())
    alone = dict(shares(smoke("crossing"), 1.0, [1001]))
    assert alone["entered: RVs"] == 100

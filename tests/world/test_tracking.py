"""The tracker follows vehicles from step to step; its log says who was where."""

from collections import defaultdict

import numpy as np
import pytest
from factories.traffic import CAR, CROSSROADS, crossroads
from hypothesis import given
from hypothesis import strategies as st

from benchmark.control.state import TrafficState, Vehicle
from benchmark.sumo.junction import Inside, Junction, ZoneLane
from benchmark.sumo.simulation import Reading
from benchmark.world import metrics
from benchmark.world.tracking import Identity, Log, Tracker

ZONE = {lane: ZoneLane(0.0, 60.0, lane[:-2]) for lane in CROSSROADS.lanes}
ZONE |= {f"northbound.upstream_{i}": ZoneLane(64.0, 100.0, "northbound") for i in range(2)}


def tracker(step: float = 1.0, asked: list[str] | None = None) -> Tracker:
    """A tracker of vehicles of which those whose names begin with rv are RVs."""
    junction = Junction(
        intersection=crossroads(step=step),
        links={},
        zone=ZONE,
        inside={
            ":in_0": Inside("N-L", "northbound_3", offset=0.0, length=20.0),
            ":in_1": Inside("N-L", "northbound_3", offset=8.0, length=20.0),
        },
        roads={},
    )

    def identify(name: str) -> Identity:
        if asked is not None:
            asked.append(name)
        return Identity(name, name.startswith("rv"), "N-L", CAR)

    return Tracker(junction, identify)


def follow(readings: list[list[Reading]], step: float = 1.0) -> Log:
    found = tracker(step)
    for number, reading in enumerate(readings, 1):
        found.update(number * step, reading, [], frozenset())
    return found.log


def rows(log: Log) -> list[tuple[float, str, str, float]]:
    """The log unfolded: time, vehicle, lane and waiting of each sight."""
    times = [time for time, here in zip(log.times, log.present, strict=True) for _ in range(here)]
    columns = zip(times, log.vehicle, log.lane, log.waiting, strict=True)
    return [(t, log.vehicles[v].id, log.lanes[lane], waited) for t, v, lane, waited in columns]


def on(lane: str, name: str = "hv", speed: float = 5.0) -> list[Reading]:
    return [(name, lane, 20.0, speed)]


def test_waiting_counts_the_seconds_that_a_vehicle_stands_in_the_zone() -> None:
    speeds = [5.0, 0.0, 0.09, 0.1, 3.0, 0.0]
    log = follow([on("northbound_1", speed=speed) for speed in speeds], step=0.5)
    assert list(log.waiting) == [0.0, 0.5, 1.0, 1.0, 1.0, 1.5]
    assert list(log.times) == [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert list(log.present) == [1] * 6
    assert log.vehicles == [Identity("hv", False, "N-L", CAR)]


def test_standing_outside_the_zone_does_not_count() -> None:
    here = on("northbound_1", speed=0.0)
    log = follow([here, [], [], here])
    assert [waited for _, _, _, waited in rows(log)] == [1.0, 2.0]
    assert list(log.present) == [1, 0, 0, 1]


def test_the_log_says_who_was_where_step_by_step() -> None:
    both = on("northbound_1", "rv") + on("northbound.upstream_0", "hv", speed=0.0)
    assert rows(follow([both, [], both[1:]])) == [
        (1.0, "rv", "northbound_1", 0.0),
        (1.0, "hv", "northbound.upstream_0", 1.0),
        (3.0, "hv", "northbound.upstream_0", 2.0),
    ]


READINGS = st.lists(
    st.dictionaries(
        st.sampled_from(["a", "b", "rv"]),
        st.tuples(st.sampled_from(sorted(ZONE)), st.sampled_from([0.0, 0.05, 0.1, 4.0])),
    ),
    max_size=25,
)


@given(readings=READINGS, step=st.sampled_from([0.5, 1.0]))
def test_the_log_agrees_with_counting_one_by_one(
    readings: list[dict[str, tuple[str, float]]], step: float
) -> None:
    log = follow(
        [[(v, lane, 9.0, speed) for v, (lane, speed) in now.items()] for now in readings], step
    )
    stood: dict[str, float] = defaultdict(float)
    expected = []
    for number, now in enumerate(readings, 1):
        for name, (lane, speed) in now.items():
            stood[name] += step if speed < 0.1 else 0
            expected.append((number * step, name, lane, stood[name]))
    assert rows(log) == expected
    assert [one.id for one in log.vehicles] == list(stood)


def test_readings_become_what_controllers_see() -> None:
    asked: list[str] = []
    found = tracker(asked=asked)
    zone = [("rv", "northbound_3", 12.0, 0.0)]
    inside = [("hv", ":in_1", 3.0, 7.0)]
    found.update(1.0, zone, inside, frozenset())
    vehicles, crossings = found.update(2.0, zone, inside, frozenset({"rv"}))
    assert vehicles == (Vehicle("rv", True, "N-L", "northbound_3", 12.0, 0.0, 2.0, True, CAR),)
    assert crossings[0][:7] == ("hv", False, "N-L", "northbound_3", 8.0 + 3.0, 20.0, 7.0)
    assert crossings[0].cell == 5
    assert sorted(asked) == ["hv", "rv"]
    assert rows(found.log) == [(1.0, "rv", "northbound_3", 1.0), (2.0, "rv", "northbound_3", 2.0)]


def test_the_log_and_the_state_agree_on_unregulated_lanes() -> None:
    reading = on("northbound_1", "rv") + on("eastbound_2", "rv2") + on("southbound_1")
    found = tracker()
    vehicles, _ = found.update(1.0, reading, [], frozenset())
    lanes = TrafficState(CROSSROADS, 1.0, vehicles, ()).unregulated_lanes
    log, count = found.log, len(CROSSROADS.regulated_lanes)
    robots = np.array([log.vehicles[index].is_robot for index in log.vehicle])
    regulated = np.array([lane in CROSSROADS.regulated_lanes for lane in log.lanes])
    step = np.zeros(len(log.vehicle), dtype=np.int64)
    ratios = metrics.unregulated_ratios(step, np.array(log.lane), robots, regulated, steps=1)
    assert (
        list(ratios) == [pytest.approx(len(lanes) / count)] == [pytest.approx((count - 2) / count)]
    )

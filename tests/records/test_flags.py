"""Marks compare with the signal on common seeds; flags are of what no signal excuses."""

from typing import Any

import pytest
from factories.records import SIGNAL, record, unlucky

from benchmark.records import leaderboard
from benchmark.records.flags import MARKS
from benchmark.records.leaderboard import Row
from benchmark.records.record import Record, Versions, Waiting


def row_of(*records: Record, controller: str = "c") -> Row:
    """The row of one controller in the leaderboard of these records."""
    (row,) = (row for row in leaderboard.rows_of_records(records) if row.controller == controller)
    return row


SUSPECT: dict[str, dict[str, Any]] = {  # the signal has 30 s, 1 s, 1000 veh/h and none
    "creeps": {"time_loss": 33.1},
    "keeps out": {"insertion_delay": 6.1},
    "blocks": {"throughput": 899.0},
    "crashes": {"collisions": 1},
}
INNOCENT: dict[str, dict[str, Any]] = {
    "creeps": {"time_loss": 33.0},
    "keeps out": {"insertion_delay": 6.0},
    "blocks": {"throughput": 900.0},
    "crashes": {"collisions": 0},
}
ALL = {key: value for facts in SUSPECT.values() for key, value in facts.items()}


def marks(waiting: float | None, *signals: Record, **facts: Any) -> tuple[str, ...]:
    """Of a controller beside these signals; the first of them if none are given."""
    beside = signals or (record(SIGNAL, rate=None, waiting=20.0),)
    return row_of(record("c", waiting=waiting, **facts), *beside).marks


def test_each_mark_has_an_example_and_a_meaning() -> None:
    assert SUSPECT.keys() == INNOCENT.keys() == MARKS.keys()


@pytest.mark.parametrize("mark", MARKS)
def test_waiting_that_is_low_for_the_wrong_reason_is_marked(mark: str) -> None:
    assert marks(19.9, **SUSPECT[mark]) == (mark,)
    assert marks(19.9, **INNOCENT[mark]) == ()


@pytest.mark.parametrize("waiting", [20.0, 20.1, None])
def test_waiting_that_is_not_below_the_signals_is_not_marked(waiting: float | None) -> None:
    assert marks(waiting, **ALL) == ()


def test_a_row_may_have_all_marks() -> None:
    assert marks(19.9, **ALL) == tuple(MARKS)


def test_marks_compare_with_the_signals_own_figures() -> None:
    light = record(SIGNAL, rate=None, time_loss=40.0, insertion_delay=9.0, collisions=1)
    assert marks(19.9, light, **ALL) == ("blocks",)


@pytest.mark.parametrize(
    "signal",
    [
        record("unsignalised", rate=None, waiting=50.0),
        unlucky(SIGNAL, rate=None),
        record(SIGNAL, rate=None, scenario="test/b"),
        record(SIGNAL, rate=None, waiting=None),
    ],
)
def test_without_a_signal_nothing_is_marked(signal: Record) -> None:
    assert marks(1.0, signal, **ALL) == ()


def test_the_signal_itself_is_not_marked() -> None:
    assert row_of(record(SIGNAL, rate=None, **ALL), controller=SIGNAL).marks == ()


def test_a_figure_that_is_missing_is_no_reason_for_a_mark() -> None:
    assert marks(19.9, time_loss=None, insertion_delay=None) == ()


def lights(*throughputs: float) -> list[Record]:
    """The signal's episodes with seeds from 1, by throughput."""
    return [
        record(SIGNAL, seed, 20.0, rate=None, throughput=flow)
        for seed, flow in enumerate(throughputs, 1)
    ]


def test_seeds_that_only_one_of_two_has_are_not_compared() -> None:
    """A light seed of one and a heavy seed of the other say nothing about either."""
    ours = record("c", seed=9, waiting=5.0, throughput=400.0)
    row = row_of(ours, *lights(1000.0, 1000.0))
    assert (row.marks, row.difference, row.status) == ((), None, "ok")
    beside = record("c", seed=1, waiting=5.0, throughput=400.0)
    assert row_of(ours, beside, *lights(1000.0, 1000.0)).marks == ("blocks",)


def test_a_mark_takes_the_seeds_of_the_arrow() -> None:
    """Over all its seeds the mean would be 10 % below the signal's; seed by seed it is equal."""
    flows = [1000.0, 980.0, 1020.0, 990.0, 1010.0, 1000.0]
    ours = [record("c", seed, 5.0, throughput=flow) for seed, flow in enumerate(flows, 1)]
    few = [record("c", seed, 5.0, throughput=300.0) for seed in (7, 8)]
    assert row_of(*ours, *few, *lights(*flows)).marks == ()


@pytest.mark.parametrize(("crashing", "deserved"), [(1, ()), (5, ("crashes",))])
def test_collisions_count_where_they_are_significant(
    crashing: int, deserved: tuple[str, ...]
) -> None:
    ours = [record("c", seed, 5.0, collisions=int(seed <= crashing)) for seed in range(1, 9)]
    assert row_of(*ours, *lights(*[1000.0] * 8)).marks == deserved


def waits(vehicles: int) -> Waiting:
    return Waiting(mean=1.6, p95=3.0, maximum=9.0, vehicles=vehicles)


@pytest.mark.parametrize(
    ("facts", "reasons"),
    [
        (
            {"never_inserted": 21, "waiting_time_per_vehicle": waits(79)},
            ("21 % of the demand never entered",),
        ),
        ({"never_inserted": 2, "waiting_time_per_vehicle": waits(30)}, ()),  # just on their way
        ({"never_inserted": 10, "waiting_time_per_vehicle": waits(990)}, ()),
        (
            {"insertion_delay": 12.4},
            ("queues beyond the road: vehicles wait 12 s to enter",),
        ),
        ({"insertion_delay": 1.9}, ()),
        ({"collisions": 3}, ("3.0 collisions an episode",)),
    ],
)
@pytest.mark.parametrize("name", ["c", SIGNAL])
def test_what_is_wrong_whatever_the_signal_does_is_flagged_also_of_the_signal(
    facts: dict[str, Any], reasons: tuple[str, ...], name: str
) -> None:
    row = row_of(record(name, rate=None, **facts), controller=name)
    assert row.reasons == reasons
    assert row.status == ("flagged" if reasons else "ok")


def test_a_collision_in_one_of_many_episodes_is_not_flagged() -> None:
    rare = [record("c", seed, collisions=int(seed == 1)) for seed in range(1, 21)]
    assert row_of(*rare).status == "ok"


@pytest.mark.parametrize("key", ["rightofway", "sumo"])
def test_records_of_several_versions_in_one_mean_are_said(key: str) -> None:
    newer = record("c", seed=2)
    versions = Versions(**{**newer.versions.model_dump(), key: "9.9.9"})
    row = row_of(record("c"), newer.model_copy(update={"versions": versions}))
    (reason,) = row.reasons
    assert "9.9.9" in reason
    assert reason.endswith("in one mean")
    assert row.status == "flagged"

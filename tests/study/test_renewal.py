"""Records of earlier code count for today's where a sample comes out equal, and only there."""

import json
import random
from pathlib import Path

import pytest
from factories.scenarios import smoke

from benchmark.plumbing.errors import StoreError
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.study.episode import Episode, run_episode
from benchmark.study.pool import LocalPool
from benchmark.study.renewal import renew, sample_of
from benchmark.study.rescoring import contradictions, differences

EPISODES = [
    Episode(smoke("tee"), controller, rate, seed)
    for controller, rate in (("traffic-light", None), ("first-come", 0.5))
    for seed in (1, 2)
]


@pytest.fixture(scope="module")
def records() -> list[Record]:
    """Of code that kept no identities."""
    return [run_episode(episode).model_copy(update={"identity": None}) for episode in EPISODES]


def test_a_sample_has_as_many_of_every_cell_as_asked_for() -> None:
    draw = random.Random(1)
    assert len(sample_of(EPISODES, 1, draw)) == 2
    assert len({episode.key[:4] for episode in sample_of(EPISODES, 1, draw)}) == 2
    assert sorted(map(repr, sample_of(EPISODES, 9, draw))) == sorted(map(repr, EPISODES))


def test_all_records_of_cells_that_come_out_equal_have_the_identity(records: list[Record]) -> None:
    sample = sample_of(EPISODES, 1, random.Random(1))
    renewal = renew(EPISODES, sample, records, LocalPool(1))
    assert (renewal.sampled, renewal.differing) == (2, {})
    renewed = [renewal.applied(record) for record in records]
    assert [record.identity for record in renewed] == [episode.identity for episode in EPISODES]
    assert [record.model_copy(update={"identity": None}) for record in renewed] == records


def test_a_cell_in_which_a_figure_differs_stays_as_it_is(records: list[Record]) -> None:
    trips = records[2].trips
    assert trips is not None
    changed = {"trips": trips.model_copy(update={"arrived": trips.arrived + 1})}
    others = [*records[:2], *(record.model_copy(update=changed) for record in records[2:])]
    renewal = renew(EPISODES, EPISODES[::2], others, LocalPool(1))
    ((place, differences),) = renewal.differing.items()
    assert place == EPISODES[2].key[:4]
    assert differences[0].startswith("trips.arrived: ")
    assert [renewal.applied(record).identity is None for record in others] == [
        *(False, False),
        *(True, True),
    ]


def test_records_are_changed_where_they_stand(records: list[Record], tmp_path: Path) -> None:
    store = Store(tmp_path)
    with store.writing():
        for record in records:
            store.append(record)
        store.rewrite(lambda record: record.model_copy(update={"identity": "f" * 64}))
    changed = store.read()
    assert {record.identity for record in changed} == {"f" * 64}
    assert [record.episode for record in changed] == [record.episode for record in records]
    with store.writing():
        store.compact()
    with pytest.raises(StoreError, match="packed; only records in JSON Lines can be changed"):
        store.rewrite(lambda record: record)


def test_fields_that_came_later_are_neither_compared_nor_added(
    records: list[Record], tmp_path: Path
) -> None:
    document = json.loads(records[2].line())
    del document["arbitration"]
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "tee.jsonl").write_text(json.dumps(document) + "\n")
    store = Store(tmp_path)
    (earlier,) = store.read()
    assert differences(earlier, records[2]) == ["arbitration: None there, flexible now"]
    assert contradictions(earlier, records[2]) == []
    assert contradictions(earlier, records[3])[0].startswith("seed: 1 there, 2 now")
    with store.writing():
        store.rewrite(lambda record: record.model_copy(update={"identity": "f" * 64}))
    (line,) = (tmp_path / "records" / "tee.jsonl").read_text().splitlines()
    assert json.loads(line) == {**document, "identity": "f" * 64}


def test_what_movements_waited_is_compared_also_where_a_movement_came_later(
    records: list[Record],
) -> None:
    junction = records[2].junctions["intersection"]
    fewer = dict(list(junction.waiting_by_movement.items())[1:])
    changed = junction.model_copy(update={"waiting_by_movement": fewer})
    earlier = records[2].model_copy(update={"junctions": {"intersection": changed}})
    assert len(contradictions(earlier, records[2])) == 1


def test_a_figure_in_its_ninth_digit_contradicts_nothing(records: list[Record]) -> None:
    trips = records[2].trips
    assert trips is not None
    assert trips.co2 is not None

    def with_co2(value: float) -> Record:
        return records[2].model_copy(update={"trips": trips.model_copy(update={"co2": value})})

    close, apart = with_co2(trips.co2 * (1 + 1e-9)), with_co2(trips.co2 * (1 + 1e-5))
    assert contradictions(close, records[2]) == []
    assert len(differences(close, records[2])) == 1
    assert len(contradictions(apart, records[2])) == 1

"""Packed records: the same lines and leaderboard; a break-off loses and doubles nothing."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from factories.records import anything, junction, record, unlucky
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from typer.testing import CliRunner

from benchmark.commands.app import app
from benchmark.control.training import Training
from benchmark.plumbing.errors import StoreError
from benchmark.records import files as record_files
from benchmark.records import leaderboard
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.records.table import record_decoder, records_table, table_schema

BOTH = {"east": junction(), "west": junction(5.0, refusals=("no such vehicle", "again"))}
SOME = (
    record(seed=1),
    record(seed=2, junctions=BOTH, trained_on=(Training(scenarios=("a",), first=1, last=2),)),
    unlucky(seed=3, reason="act raised\nValueError: ü"),
    record("traffic-light", rate=None, controller_from="mine.py sha256:abc"),
)


def filled(folder: Path, *records: Record) -> Store:
    store = Store(folder)
    with store.writing():
        for one in records:
            store.append(one)
    return store


def packed(store: Store) -> int:
    with store.writing():
        return store.compact()


def files(store: Store) -> list[str]:
    return sorted(path.name for path in store.records_folder.iterdir() if path.name[0] != ".")


def lines(store: Store) -> list[bytes]:
    found = record_files.list_files(store.records_folder)
    return [line for path in found for line in record_files.read_lines(path)]


@settings(max_examples=15)
@given(records=st.lists(anything(Record), min_size=1, max_size=4), more=anything(Record))
def test_any_lines_come_back_byte_for_byte(
    tmp_path_factory: pytest.TempPathFactory, records: list[Record], more: Record
) -> None:
    records = [one.model_copy(update={"scenario": "a", "seed": 1}) for one in [*records, more]]
    store = filled(tmp_path_factory.mktemp("store"), *records[:-1])
    before = lines(store)
    assert packed(store) == 1
    assert lines(store) == before
    with store.writing():
        store.append(records[-1])
    assert store.read() == records  # packed ones first
    assert packed(store) == 1
    assert files(store) == ["a.1.parquet", "a.2.parquet"]
    assert store.read() == records
    assert packed(store) == 0


@settings(max_examples=40)
@given(record=anything(Record))
def test_lines_are_read_fast_as_they_are_with_care(record: Record) -> None:
    found = record_decoder().decode(record.line())
    for name in Record.model_fields:
        if name not in ("junctions", "trips", "versions", "trained_on"):
            assert getattr(found, name) == getattr(record, name)
    wanted = records_table([record.model_copy(update={"seed": 1})])
    found.seed = 1
    assert_frame_equal(records_table([found]), wanted)


def test_what_is_no_record_is_none_however_it_is_read() -> None:
    good = json.loads(record().line())
    for change in ({"seed": "x"}, {"more": 1}, {"status": "fine"}, {"schema": 2}, {"trips": {}}):
        with pytest.raises(Exception, match=r"Expected|Invalid|unknown|missing"):
            record_decoder().decode(json.dumps({**good, **change}))


def test_table_and_leaderboard_stay_as_they_were(tmp_path: Path) -> None:
    store = filled(tmp_path, *SOME)
    table, board = store.table(), leaderboard.rows_of_records(store.read())
    assert leaderboard.rows_of(table) == board
    packed(store)
    assert_frame_equal(store.table(), table)
    with store.writing():
        store.append(record(seed=1, waiting=99.0))
    changed = leaderboard.rows_of(store.table())
    assert changed == leaderboard.rows_of_records([*SOME, record(seed=1, waiting=99.0)]) != board


def test_many_parts_and_files_keep_their_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(record_files, "PART", 2)
    store = filled(tmp_path, *(record(seed=seed, scenario="test/a.1") for seed in range(5)))
    for start in range(5, 15):  # more than nine, as text 10 comes before 9
        packed(store)
        with store.writing():
            store.append(record(seed=start, scenario="test/a.1"))
    assert [one.seed for one in store.records()] == [*range(15)]
    assert store.table()["seed"].to_list() == [*range(15)]
    assert store.table()["record"].to_list() == [*range(15)]


def test_columns_of_another_version_are_read_from_the_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = filled(tmp_path, *SOME)
    table = store.table()
    usual = table_schema()
    monkeypatch.setattr(record_files, "table_schema", lambda: {**usual, "once": usual["record"]})
    monkeypatch.setattr(record_files, "records_table", lambda records: table.with_columns(once=0))
    packed(store)
    monkeypatch.undo()
    assert_frame_equal(store.table(), table)


def fails(*given: Any, **_: object) -> None:
    if isinstance(given[0], Path) and given[0].name == ".probe":
        given[0].rename(given[0].with_suffix(".gone"))
        return
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize(
    ("place", "left"),
    [
        ("_write_part", ["test-a.1.lines"]),  # a full disk
        ("shutil.rmtree", ["test-a.1.lines"]),  # before anything
        ("_sync", ["test-a.1.lines"]),  # just as it was set apart
        ("Path.unlink", ["test-a.1.lines", "test-a.1.parquet"]),  # when all is written
    ],
)
def test_whenever_it_breaks_off_each_record_is_there_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str, left: list[str]
) -> None:
    store = filled(tmp_path, *SOME)
    before = lines(store)
    with monkeypatch.context() as patch:
        owner: Any = record_files
        *outer, name = place.split(".")
        for one in outer:
            owner = getattr(owner, one)
        patch.setattr(owner, name, fails)
        with pytest.raises((StoreError, OSError), match="No space left"), store.writing():
            store.compact()
    assert [one for one in files(store) if not one.endswith(".draft")] == left
    assert lines(store) == before
    packed(store)
    assert files(store) == ["test-a.1.parquet"]
    assert lines(store) == before


def test_what_comes_back_otherwise_is_not_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = filled(tmp_path, *SOME)
    before = lines(store)
    write = record_files._write_part

    def forgetful(part: Path, some: list[tuple[bytes, Any]]) -> None:
        write(part, some[:-1])

    monkeypatch.setattr(record_files, "_write_part", forgetful)
    with pytest.raises(StoreError, match="came back otherwise"):
        packed(store)
    assert lines(store) == before


@pytest.mark.parametrize("line", [b"{}", b'{"scenario": "\xff"}', b"\xff\xfe", b"[1, 2]", b'{"a'])
def test_a_line_that_is_no_record_is_named_before_anything_moves(
    tmp_path: Path, line: bytes
) -> None:
    store = filled(tmp_path, *SOME, record(scenario="test/b"))
    path = store.records_folder / "test-b.jsonl"
    path.write_bytes(line + b"\n" + path.read_bytes())
    with pytest.raises(StoreError, match=r"test-b.jsonl:1"):
        store.table()
    before = files(store)
    with pytest.raises(StoreError, match=r"test-b.jsonl:1"):
        packed(store)
    assert files(store) == before


def test_the_command_says_what_it_saved_and_when_there_is_nothing_to_do(tmp_path: Path) -> None:
    filled(tmp_path, *SOME)
    call: Callable[..., Any] = CliRunner().invoke
    first = call(app, ["compact", "--records", str(tmp_path / "records")])
    assert (first.exit_code, "1 files packed: 0.0 MB before" in first.output) == (0, True)
    again = call(app, ["compact", "--records", str(tmp_path)])
    assert again.output == "all records are packed already\n"
    shown = call(app, ["leaderboard", "--records", str(tmp_path), "--format", "csv"])
    assert "traffic-light" in shown.output
    nothing = call(app, ["compact", "--records", str(tmp_path / "other")])
    assert isinstance(nothing.exception, StoreError)
    assert "no records here" in str(nothing.exception)

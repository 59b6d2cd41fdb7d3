"""Records on disk: what goes in comes out, and nothing that was written is lost."""

import json
import math
import resource
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import polars
import pytest
from factories.records import anything, filled, unlucky
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from benchmark.plumbing.errors import StoreError
from benchmark.records import files
from benchmark.records.record import Record, Versions, Waiting
from benchmark.records.store import Store

VERSIONS = Versions(rightofway="0.1.0", sumo="1.28.0", python="3.11.7")


def record(seed: int = 1, **facts: Any) -> Record:
    settled = {"scenario": "test/a", "controller": "c", "rate": 0.5, "status": "skipped"}
    return Record(
        **{**settled, "seed": seed, "scenario_hash": "abc", "versions": VERSIONS, **facts}
    )


@settings(max_examples=50)
@given(records=st.lists(anything(Record), min_size=1, max_size=3))
def test_records_come_back_as_they_were_bit_for_bit(records: list[Record]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        store.prepare()
        for one in records:
            store.append(one)
        found = Store(Path(folder)).read()
    key = Record.line  # tells -0.0 from 0.0
    assert sorted(found, key=key) == sorted(records, key=key)
    assert sorted(map(key, found)) == sorted(map(key, records))


@pytest.mark.parametrize(
    "value", [0.1, 1 / 3, -0.0, 5e-324, 2.2250738585072011e-308, 1.7976931348623157e308, 2**53 + 2]
)
def test_floats_come_back_to_the_last_bit(value: float, tmp_path: Path) -> None:
    filled(tmp_path, record(wall_time=value))
    (found,) = Store(tmp_path).read()
    assert found.wall_time.hex() == float(value).hex()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_figure_that_is_no_number_makes_no_record(value: float) -> None:
    """JSON has no word for it: the line could not be read again."""
    with pytest.raises(ValidationError, match="finite"):
        record(wall_time=value)
    with pytest.raises(ValidationError, match="finite"):
        Waiting(mean=value, p95=0.0, maximum=0.0, vehicles=1)


def test_a_message_that_is_not_unicode_still_makes_a_record(tmp_path: Path) -> None:
    """A controller may raise with a file name that could not be decoded."""
    filled(tmp_path, record(status="failed", reason="cannot open bad\udcff.pt"))
    (found,) = Store(tmp_path).read()
    assert found.reason is not None
    assert "cannot open bad" in found.reason


def test_a_line_of_json_names_the_schema_first(tmp_path: Path) -> None:
    path = filled(tmp_path, record())
    assert next(iter(json.loads(path.read_text()).items())) == ("schema", 1)
    assert set(json.loads(path.read_text())) >= {"scenario", "rate", "seed", "status", "versions"}


def test_episodes_differ_by_scenario_hash_controller_rate_and_seed() -> None:
    others = [
        {"scenario": "test/b"},
        {"scenario_hash": "abd"},
        {"controller": "d"},
        {"rate": None},
        {"seed": 2},
    ]
    keys = {record(**other).episode for other in [{}, *others]}
    assert len(keys) == 1 + len(others)
    assert record(status="ok", wall_time=9.0).episode == record().episode


def test_each_scenario_has_its_own_file_and_appending_only_adds(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.prepare()
    first = [record(1), record(2, scenario="test/b"), record(3)]
    for one in first:
        store.append(one)
    files = {path.name: path.read_bytes() for path in store.records_folder.iterdir()}
    assert set(files) == {"test-a.jsonl", "test-b.jsonl"}
    assert [one.seed for one in store.read()] == [1, 3, 2]
    again = Store(tmp_path)
    again.prepare()
    again.append(record(1, status="failed"))
    for name, before in files.items():
        assert (store.records_folder / name).read_bytes().startswith(before)
    assert [(one.seed, one.status) for one in again.read()] == [
        *((1, "skipped"), (3, "skipped"), (1, "failed"), (2, "skipped"))
    ]


@pytest.mark.parametrize("name", ["../../escape", "/etc/a", "a b/ü|<", "..", "", "-", "a\nb"])
def test_a_scenarios_name_leads_to_a_file_among_the_records(name: str, tmp_path: Path) -> None:
    path = filled(tmp_path, record(scenario=name))
    assert path.parent == tmp_path / "records"
    assert path.name.endswith(".jsonl")
    assert [one.scenario for one in Store(tmp_path).read()] == [name]


def test_names_that_share_a_file_keep_their_records_apart(tmp_path: Path) -> None:
    names = ["a/b", "a-b", "a b"]
    filled(tmp_path, *(record(scenario=name) for name in names))
    assert [one.scenario for one in Store(tmp_path).read()] == names


def test_preparing_leaves_an_empty_folder_and_may_be_repeated(tmp_path: Path) -> None:
    store = Store(tmp_path / "deep" / "out")
    for _ in range(2):
        store.prepare()
    assert list(store.records_folder.iterdir()) == []


def test_a_line_torn_at_any_byte_is_set_aside_and_the_others_stay(tmp_path: Path) -> None:
    path = filled(tmp_path, record(1), record(2), record(3, reason="ü\n"))
    whole = path.read_bytes()
    start = len(whole) - len(whole.splitlines(keepends=True)[-1])
    torn_file = path.with_name("test-a.jsonl.torn")
    for cut in range(start + 1, len(whole) - 1):  # the last byte is its newline
        path.write_bytes(whole[:cut])
        notices: list[str] = []
        store = Store(tmp_path, notice=notices.append)
        assert [one.seed for one in store.read()] == [1, 2]
        assert path.read_bytes() == whole[:cut]  # reading changes nothing
        store.prepare()
        assert [message.startswith(f"{path}: ") for message in notices] == [True, True]
        assert "half-written" in notices[0]
        assert torn_file.name in notices[1]
        assert path.read_bytes() == whole[:start]
        assert torn_file.read_bytes() == whole[start:cut] + b"\n"
        store.append(record(4))
        assert [one.seed for one in store.read()] == [1, 2, 4]
        assert len(notices) == 2
        torn_file.unlink()


def test_a_whole_file_has_no_torn_line(tmp_path: Path) -> None:
    path = filled(tmp_path, record(1), record(2))
    notices: list[str] = []
    store = Store(tmp_path, notice=notices.append)
    before = path.read_bytes()
    store.prepare()
    assert len(store.read()) == 2
    assert (notices, path.read_bytes(), len(list(path.parent.iterdir()))) == ([], before, 1)


def test_a_line_that_only_lacks_its_newline_is_a_record(tmp_path: Path) -> None:
    path = filled(tmp_path, record(1), record(2))
    whole = path.read_bytes()
    path.write_bytes(whole.removesuffix(b"\n"))
    notices: list[str] = []
    store = Store(tmp_path, notice=notices.append)
    assert [one.seed for one in store.read()] == [1, 2]
    store.prepare()
    assert (notices, path.read_bytes(), len(list(path.parent.iterdir()))) == ([], whole, 1)


def test_torn_lines_gather(tmp_path: Path) -> None:
    path = filled(tmp_path, record(1))
    for part in (b'{"sch', b"{"):
        path.write_bytes(path.read_bytes() + part)
        Store(tmp_path).prepare()
    assert path.with_name("test-a.jsonl.torn").read_bytes() == b'{"sch\n{\n'
    assert len(Store(tmp_path).read()) == 1


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        (b"not JSON", "not a record"),
        (b"[]", "not a record"),
        (b"5", "not a record"),
        (b"\xff\xfe\x00", "not a record"),
        (b'{"schema": 1}', "scenario: this key is required"),
        (record().line().replace('"seed":1', '"seed":"one"').encode(), "seed: "),
        (record().line().replace('"seed"', '"sead"').encode(), 'did you mean "seed"?'),
        (record().line().replace('"schema":1', '"schema":2').encode(), "newer Right of Way"),
        (b'{"schema": 3, "something": "else"}', "upgrade"),
        (b'{"schema": 0}', "schema: "),
    ],
)
def test_a_line_that_is_no_record_is_an_error_with_file_and_line(
    line: bytes, hint: str, tmp_path: Path
) -> None:
    path = filled(tmp_path, record())
    path.write_bytes(path.read_bytes() + b"\n" + line.strip() + b"\n" + path.read_bytes())
    with pytest.raises(StoreError, match=r"test-a\.jsonl:3: ") as caught:
        Store(tmp_path).read()
    assert all(found.startswith(f"{path}:3: ") for found in str(caught.value).splitlines())
    assert hint in str(caught.value)


@pytest.mark.parametrize("make", [None, "records", "records/notes.txt"])
def test_a_folder_without_records_is_an_error_with_the_remedy(
    make: str | None, tmp_path: Path
) -> None:
    if make:
        (tmp_path / make).mkdir(parents=True)
    with pytest.raises(StoreError, match="no records here") as caught:
        Store(tmp_path).read()
    assert str(tmp_path / "records") in str(caught.value)
    assert f"`rightofway run --out {tmp_path}`" in str(caught.value)


def test_a_folder_that_cannot_be_written_is_an_error_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    store = Store(tmp_path / "file" / "out")
    with pytest.raises(StoreError, match=r"cannot write records: .*another folder") as caught:
        store.prepare()
    assert str(store.records_folder) in str(caught.value)
    with pytest.raises(StoreError, match="cannot append") as caught:
        store.append(record())
    assert str(store.records_folder) in str(caught.value)


@pytest.mark.parametrize("use", [Store.read, Store.prepare])
def test_a_file_that_cannot_be_read_is_an_error_with_its_name(
    use: Callable[[Store], object], tmp_path: Path
) -> None:
    path = filled(tmp_path, record()).with_name("z.jsonl")
    path.mkdir()
    with pytest.raises(StoreError) as caught:
        use(Store(tmp_path))
    assert str(caught.value).startswith(f"{path}: ")


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file can grow beyond a size; this process refuses as a full disk does."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("length", [10, 5_000, 20_000])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_full_disk_leaves_whole_records_only(length: int, share: float, tmp_path: Path) -> None:
    path = filled(tmp_path, record(1), record(2))
    before = path.read_bytes()
    large = record(3, reason="x" * length)
    store = Store(tmp_path)
    with (
        room_for(len(before) + int(share * len(large.line()))),
        pytest.raises(StoreError, match=r"test-a\.jsonl: cannot append a record: "),
    ):
        store.append(large)
    assert path.read_bytes() == before
    store.append(large)
    assert [one.seed for one in store.read()] == [1, 2, 3]


@pytest.mark.parametrize(
    ("torn", "room"), [(b'{"schema": 1', 5), (record(2).line()[:-1].encode(), 0)]
)
def test_a_last_line_that_cannot_be_mended_is_an_error_and_stays(
    torn: bytes, room: int, tmp_path: Path
) -> None:
    path = filled(tmp_path, record(1))
    path.write_bytes(before := path.read_bytes() + torn)
    with (
        room_for(room or len(before)),
        pytest.raises(StoreError, match=r"test-a\.jsonl: cannot "),
    ):
        Store(tmp_path).prepare()
    assert path.read_bytes() == before


def test_a_record_is_read_only_and_refuses_unknown_keys() -> None:
    one = record()
    with pytest.raises(ValidationError, match="frozen"):
        one.seed = 2  # type: ignore[misc]
    with pytest.raises(ValidationError, match="extra_forbidden"):
        record(sead=1)


@pytest.mark.parametrize("line", ["[" * 3000, '{"scenario":' * 3000, '{"junctions":' + "[" * 9000])
def test_a_line_that_is_nested_without_end_is_one_message(tmp_path: Path, line: str) -> None:
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "a.jsonl").write_text(line + "\n")
    for read in (Store(tmp_path).read, Store(tmp_path).table):
        with pytest.raises(StoreError, match=r"a.jsonl:1: "):
            read()


def test_a_line_without_end_is_not_read_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "LONGEST_LINE", 1000)
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "a.jsonl").write_text("x" * 2000)
    with pytest.raises(StoreError, match="a line of more than 1000 bytes"):
        Store(tmp_path).read()


def test_packed_lines_that_each_row_would_repeat_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(files, "LARGEST_PART", 2**24)
    part = tmp_path / "records" / "a.1.parquet"
    part.mkdir(parents=True)
    rows = polars.DataFrame({"line": polars.repeat("x" * 30_000, 1000, eager=True)})
    rows.write_parquet(part / "000000.parquet")
    for read in (Store(tmp_path).read, Store(tmp_path).table):
        with pytest.raises(StoreError, match="lines that are longer than records"):
            read()


def test_texts_that_steer_a_terminal_reach_no_table(tmp_path: Path) -> None:
    evil = "\x1b[2J\u202ea"
    bad = unlucky("a").model_dump(mode="json", by_alias=True)
    bad |= {"scenario": evil, "controller": evil, "reason": evil, "status": "failed"}
    (tmp_path / "records").mkdir()
    (tmp_path / "records" / "a.jsonl").write_text(json.dumps(bad) + "\n")
    plain = r"\x1b[2J\u202ea"
    (read,) = Store(tmp_path).read()
    assert (read.scenario, read.controller, read.reason) == (plain,) * 3
    for _ in range(2):
        row = Store(tmp_path).table().row(0, named=True)
        assert (row["scenario"], row["controller"], row["reason"]) == (plain,) * 3
        Store(tmp_path).compact()

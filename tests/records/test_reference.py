"""A reference: written whole or not at all, read only if whole, and ours equals what code gives."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from factories.comparisons import MADE, written
from factories.records import record

from benchmark.plumbing.errors import StoreError, UsageError
from benchmark.records import reference
from benchmark.records.record import Record
from benchmark.records.store import Store


def refuse(message: str) -> None:
    raise AssertionError(message)


def some(count: int = 3, **facts: Any) -> list[Record]:
    return [record(seed=seed, wall_time=seed / 7, **facts) for seed in range(count, 0, -1)]


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_reference_comes_back_with_its_provenance(tmp_path: Path) -> None:
    folder = written(tmp_path / "deep" / "ref", [*some(), *some(scenario="test/b")])
    found = reference.read_reference(folder, refuse)
    assert [(one.scenario, one.seed) for one in found.records] == [
        (name, seed) for name in ("test/a", "test/b") for seed in (1, 2, 3)
    ]
    assert {one.wall_time for one in found.records} == {0.0}
    assert found.provenance is not None
    assert found.provenance.episodes == 6
    given = {"episodes": 8, "records_hash": "b"}
    assert found.provenance.model_copy(update=given) == MADE
    assert reference.read_reference(folder / "records", refuse) == found


def test_the_same_records_in_any_order_give_the_same_files(tmp_path: Path) -> None:
    records = [*some(), *some(rate=None), *some(controller="d")]
    one, other = written(tmp_path / "a", records), written(tmp_path / "b", records[::-1])
    assert contents(one) == contents(other)


def test_ends_of_lines_do_not_matter(tmp_path: Path) -> None:
    """Git may turn them round."""
    folder = written(tmp_path / "ref", some())
    (path,) = (folder / "records").iterdir()
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert len(reference.read_reference(folder, refuse).records) == 3


def test_a_results_folder_serves_with_a_notice(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.prepare()
    store.append(record())
    notices: list[str] = []
    found = reference.read_reference(tmp_path, notices.append)
    assert (found.provenance, len(found.records)) == (None, 1)
    assert "no reference.toml" in notices[0]


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.read_bytes().rindex(b"{")])


def change(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b'"throughput":1000.0', b'"throughput":1000.5', 1))


def double(path: Path) -> None:
    path.write_bytes(path.read_bytes() + path.read_bytes().splitlines(keepends=True)[0])


def tear(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-9])


@pytest.mark.parametrize("damage", [cut, change, double, tear, Path.unlink])
def test_a_reference_that_is_not_as_it_was_made_is_refused(
    damage: Callable[[Path], None], tmp_path: Path
) -> None:
    folder = written(tmp_path / "ref", [*some(), *some(scenario="test/b")])
    damage(folder / "records" / "test-b.jsonl")
    with pytest.raises(StoreError, match="rightofway reference update"):
        reference.read_reference(folder, refuse)


def test_a_new_reference_replaces_the_old_one_and_leaves_nothing_else(tmp_path: Path) -> None:
    folder = written(tmp_path / "ref", [*some(), *some(scenario="test/gone")])
    reference.check_target(folder)
    written(folder, some(5))
    assert len(reference.read_reference(folder, refuse).records) == 5
    assert [path.name for path in tmp_path.iterdir()] == ["ref"]


@pytest.mark.parametrize("name", ["append", "hash_of_lines", "as_toml", "rename", "second rename"])
@pytest.mark.parametrize("kind", [KeyboardInterrupt, OSError])
def test_whatever_goes_wrong_the_old_reference_stays(
    name: str, kind: type[BaseException], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = written(tmp_path / "ref", some())
    before = contents(tmp_path)
    rename, calls = Path.rename, 0

    def fail(*_: object, **__: object) -> None:
        raise kind(28, "No space left on device")

    def second_fails(source: Path, target: Path) -> Path:
        nonlocal calls
        calls += 1
        return fail() if calls == 2 else rename(source, target)  # type: ignore[func-returns-value]

    owner: Any = {"append": Store, "hash_of_lines": reference, "as_toml": type(MADE)}.get(
        name, Path
    )
    replacement = second_fails if name == "second rename" else fail
    monkeypatch.setattr(owner, name.removeprefix("second "), replacement)
    with pytest.raises(StoreError if kind is OSError else kind):
        written(folder, some(5))
    monkeypatch.undo()
    assert contents(tmp_path) == before
    assert [path.name for path in tmp_path.iterdir()] == ["ref"]


def test_a_folder_that_holds_other_things_is_no_target(tmp_path: Path) -> None:
    folder = written(tmp_path / "ref", some())
    (folder / "notes.txt").touch()
    with pytest.raises(UsageError, match=r"notes\.txt is no part of a reference"):
        reference.check_target(folder)
    (tmp_path / "file").touch()
    for path, words in ((tmp_path, "but no reference.toml"), (tmp_path / "file", "is a file")):
        with pytest.raises(UsageError, match=words):
            reference.check_target(path)
    with pytest.raises(StoreError, match="cannot write beside it"):
        reference.check_target(tmp_path / "file" / "ref")
    (tmp_path / "empty").mkdir()
    reference.check_target(tmp_path / "empty")
    reference.check_target(tmp_path / "new" / "ref")

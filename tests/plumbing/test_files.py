"""Files and folders appear whole or not at all, and a disk that refuses is named."""

from pathlib import Path

import pytest

from benchmark.plumbing import files
from benchmark.plumbing.errors import StoreError, UsageError


def fill(folder: Path, words: str) -> None:
    folder.mkdir(exist_ok=True)
    (folder / "a.txt").write_text(words)


def test_a_file_takes_the_place_of_another_when_it_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")
    with files.replaced(target) as draft:
        assert draft.name == "a.txt"  # some writers look at its ending
        draft.write_text("new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def test_a_folder_takes_the_place_of_another_with_all_that_it_holds(tmp_path: Path) -> None:
    target = tmp_path / "made"
    fill(target, "old")
    (target / "more.txt").touch()
    with files.replaced(target) as draft:
        fill(draft, "new")
    assert [path.name for path in target.iterdir()] == ["a.txt"]
    assert (target / "a.txt").read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def broken_off(target: Path) -> None:
    with files.replaced(target) as draft:
        fill(draft, "new")
        raise KeyboardInterrupt


def test_what_breaks_off_leaves_the_old_one_and_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "made"
    fill(target, "old")
    with pytest.raises(KeyboardInterrupt):
        broken_off(target)
    assert (target / "a.txt").read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_an_old_folder_comes_back_where_the_new_one_cannot_take_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "made"
    fill(target, "old")
    rename = Path.rename

    def refuse(path: Path, goal: Path) -> Path:
        if path.name == "made" and path != target:
            raise OSError(28, "No space left on device")
        return rename(path, goal)

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(OSError, match="No space left"), files.replaced(target) as draft:
        fill(draft, "new")
    assert (target / "a.txt").read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_through_a_link_its_target_is_replaced(tmp_path: Path) -> None:
    target, link = tmp_path / "a.txt", tmp_path / "link"
    target.write_text("old")
    link.symlink_to(target)
    with files.replaced(link) as draft:
        draft.write_text("new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_a_folder_is_made_once_whoever_comes_first(tmp_path: Path) -> None:
    target = tmp_path / "deep" / "made"

    def meanwhile(draft: Path) -> None:
        fill(draft, "mine")
        fill(target, "theirs")

    assert files.made_once(target, meanwhile) == target
    assert files.made_once(target, lambda draft: fill(draft, "late")) == target
    assert (target / "a.txt").read_text() == "theirs"
    assert list(target.parent.iterdir()) == [target]


def test_a_folder_is_made_and_nothing_stays_in_it(tmp_path: Path) -> None:
    files.prepare_folder(tmp_path / "deep" / "logs", "action logs")
    assert list((tmp_path / "deep" / "logs").iterdir()) == []


def test_a_refusal_names_path_reason_and_remedy(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="file/logs: cannot write action logs: Not a directory; "):
        files.prepare_folder(tmp_path / "file" / "logs", "action logs")
    gone = tmp_path / "no" / "a.txt"
    words = r"no/a\.txt: cannot write: No such file or directory$"
    with pytest.raises(UsageError, match=words), files.writing(gone, remedy=""):
        gone.touch()

"""Archives from strangers are looked through before anything of them is written."""

import io
import stat
import struct
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from factories.paths import BAD, PATHS
from hypothesis import given
from hypothesis import strategies as st

from benchmark.admission.submission import archive
from benchmark.plumbing import confined
from benchmark.plumbing.errors import BundleError


def zipped(path: Path, *members: tuple[str | zipfile.ZipInfo, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in members:
            file.writestr(name, content)
    return path


def named(name: str, mode: int = 0) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo("placeholder")
    info.filename = name  # the constructor would tidy it
    info.external_attr = mode << 16
    return info


def refused(path: Path) -> str:
    """The message; nothing was written."""
    folder = path.parent / "unpacked"
    folder.mkdir(exist_ok=True)
    with pytest.raises(BundleError) as caught:
        archive.extract(path, folder)
    assert list(folder.iterdir()) == []
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text


def test_what_was_written_comes_out_again(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(b"\0\1")
    members = {"manifest.toml": b"format = 1", "code/a/b.py": source, "empty": b""}
    archive.write(tmp_path / "a.zip", members)
    archive.write(tmp_path / "b.zip", members)
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    folder = tmp_path / "unpacked"
    folder.mkdir()
    assert archive.extract(tmp_path / "a.zip", folder) == list(members)
    assert (folder / "code/a/b.py").read_bytes() == b"\0\1"
    assert (folder / "manifest.toml").read_bytes() == b"format = 1"


def test_folders_in_an_archive_are_passed_over(tmp_path: Path) -> None:
    path = zipped(tmp_path / "a.zip", ("code/", b""), ("code/a.py", b"x"))
    folder = tmp_path / "unpacked"
    folder.mkdir()
    assert archive.extract(path, folder) == ["code/a.py"]


@pytest.mark.parametrize("name", [name for name in BAD if name not in ("\ud800", "a/", "")])
def test_a_member_that_leads_out_is_refused(tmp_path: Path, name: str) -> None:
    path = zipped(tmp_path / "a.zip", ("good", b"x"), (named(name), b"x"))
    assert BAD[name] in refused(path)


@given(names=st.lists(PATHS, min_size=1, max_size=4, unique=True))
def test_an_archive_is_refused_or_lies_where_it_should(
    tmp_path_factory: pytest.TempPathFactory, names: list[str]
) -> None:
    encodable = [one for one in names if one.encode(errors="replace").decode() == one]
    base = tmp_path_factory.mktemp("any")
    path = zipped(base / "a.zip", *((named(one), b"x") for one in encodable))
    folder = base / "deep" / "unpacked"
    folder.mkdir(parents=True)
    try:
        held = archive.extract(path, folder)
    except BundleError:
        assert list(folder.iterdir()) == []
    else:
        files = [one for one in folder.rglob("*") if one.is_file()]
        assert len(files) == len(held)
        assert all(confined.problem(one) is None for one in held)
    assert {one.name for one in base.iterdir()} == {"a.zip", "deep"}
    assert {one.name for one in (base / "deep").iterdir()} == {"unpacked"}


@pytest.mark.parametrize(
    "mode", [stat.S_IFLNK | 0o777, stat.S_IFCHR | 0o666, stat.S_IFIFO, stat.S_IFDIR, stat.S_IFSOCK]
)
def test_links_and_devices_are_refused(tmp_path: Path, mode: int) -> None:
    path = zipped(tmp_path / "a.zip", ("good", b"x"), (named("bad", mode), b"/etc/passwd"))
    assert "'bad' is a link or device" in refused(path)


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("second", ["a", "A", "a/b"])
def test_members_that_clash_are_refused(tmp_path: Path, second: str) -> None:
    path = zipped(tmp_path / "a.zip", ("a", b"1"), (second, b"2"))
    assert "stands twice, or as file and folder" in refused(path)


def test_a_bomb_is_refused(tmp_path: Path) -> None:
    path = zipped(tmp_path / "a.zip", ("zeros", bytes(20 * 2**20)))
    assert path.stat().st_size < 100_000
    assert "grows from" in refused(path)


def test_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = zipped(tmp_path / "a.zip", *((f"{i}", b"12345") for i in range(5)))
    monkeypatch.setattr(archive, "LARGEST_TOTAL", 24)
    assert "unpacks to 25 bytes" in refused(path)
    monkeypatch.setattr(archive, "LARGEST_MEMBER", 4)
    assert "has 5 bytes, too many" in refused(path)
    monkeypatch.setattr(archive, "MOST_MEMBERS", 4)
    assert "5 members; a bundle has at most 4" in refused(path)


def test_a_size_that_lies_gets_nowhere(tmp_path: Path) -> None:
    path = zipped(tmp_path / "a.zip", ("zeros", bytes(2**20)))
    content = path.read_bytes()
    path.write_bytes(content.replace(struct.pack("<L", 2**20), struct.pack("<L", 10)))
    assert "not a whole zip archive" in refused(path)


def _tar() -> bytes:
    target = io.BytesIO()
    with tarfile.open(fileobj=target, mode="w") as file:
        file.addfile(tarfile.TarInfo("x"))
    return target.getvalue()


@pytest.mark.parametrize(
    "inner",
    [b"PK\x03\x04rest", b"\x1f\x8brest", b"BZh9", b"\xfd7zXZ\0", b"\x28\xb5\x2f\xfd", _tar()],
)
def test_archives_within_archives_are_refused(tmp_path: Path, inner: bytes) -> None:
    path = zipped(tmp_path / "a.zip", ("good", b"x"), ("records/a.jsonl", inner))
    assert "'records/a.jsonl' is itself an archive" in refused(path)


def test_other_compressions_and_secrets_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as file:
        file.writestr("a", b"x")
    assert "another method than deflate" in refused(path)
    whole = zipped(path, ("a", b"x")).read_bytes()
    central = whole.index(b"PK\x01\x02")
    path.write_bytes(whole[: central + 8] + b"\1" + whole[central + 9 :])
    assert "is encrypted" in refused(path)


Maker = Callable[[Path], None]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda path: None, "cannot read the bundle: No such file"),
        (lambda path: path.mkdir(), "cannot read the bundle: Is a directory"),
        (lambda path: path.write_bytes(b""), "not a whole zip archive"),
        (lambda path: path.write_bytes(b"hello" * 99), "not a whole zip archive"),
    ],
)
def test_what_is_no_archive_is_refused(tmp_path: Path, make: Maker, said: str) -> None:
    path = tmp_path / "a.zip"
    make(path)
    assert said in refused(path)


@given(data=st.data())
def test_an_archive_that_was_cut_is_refused(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    base = tmp_path_factory.mktemp("cut")
    whole = zipped(base / "a.zip", ("a", b"x" * 500), ("b/c", b"y")).read_bytes()
    (base / "a.zip").write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    assert "not a whole zip archive" in refused(base / "a.zip")


def test_a_member_that_was_changed_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("a", b"waiting: 12")
    path.write_bytes(path.read_bytes().replace(b"waiting: 12", b"waiting: 11"))
    assert "Bad CRC-32" in refused(path)

"""Zip archives from strangers: looked through before anything of them is written."""

import shutil
import stat
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from benchmark.plumbing import confined
from benchmark.plumbing.errors import BundleError

MOST_MEMBERS = 20_000
LARGEST_MEMBER = 256 * 2**20  # bytes
LARGEST_TOTAL = 1024 * 2**20  # bytes
STEEPEST = 100  # times that a member may grow; records in JSON grow about tenfold
SMALL = 2**20  # bytes below which growth is no matter
ENCRYPTED = 0x1
HEAD = 512  # bytes by which archives are recognised
NESTED = {
    b"PK\x03\x04": "zip",
    b"PK\x05\x06": "zip",
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
    b"\x28\xb5\x2f\xfd": "zstd",
    b"\x04\x22\x4d\x18": "lz4",
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!": "rar",
}


def extract(path: Path, folder: Path) -> list[str]:
    """Write an archive's files into an empty folder, once all of them are found harmless.

    Returns:
        Their names.

    Raises:
        BundleError: it is no whole zip archive, or holds what it should not: paths that lead out
            of the folder, links, devices, names that clash, archives, more than a bundle can need.
    """
    with _opened(path) as archive:
        _check_listing(path, archive.infolist())
        members = [member for member in archive.infolist() if not member.is_dir()]
        for member in members:
            _check_content(path, member, archive)
        for member in members:
            target = confined.inside(folder, member.filename)
            target.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(member) as source, target.open("xb") as file:
                shutil.copyfileobj(source, file)
        return [member.filename for member in members]


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except OSError as error:
        raise BundleError(f"{path}: cannot read the bundle: {error.strerror or error}") from error
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, ValueError) as error:
        raise BundleError(
            f"{path}: not a whole zip archive ({error}); expected what `rightofway submit` wrote"
        ) from error


def _check_listing(path: Path, members: list[zipfile.ZipInfo]) -> None:
    """Whatever can be said of an archive without unpacking a byte."""
    if len(members) > MOST_MEMBERS:
        raise BundleError(f"{path}: {len(members)} members; a bundle has at most {MOST_MEMBERS}")
    for member in members:
        if problem := _problem(member):
            raise BundleError(f"{path}: member {member.orig_filename!r} {problem}; refused")
    names = [member.filename for member in members if not member.is_dir()]
    if name := confined.clash(names):
        raise BundleError(f"{path}: member {name!r} stands twice, or as file and folder; refused")
    if (total := sum(member.file_size for member in members)) > LARGEST_TOTAL:
        raise BundleError(f"{path}: unpacks to {total} bytes, at most {LARGEST_TOTAL}; refused")


def _problem(member: zipfile.ZipInfo) -> str | None:
    kind = stat.S_IFMT(member.external_attr >> 16)
    # zipfile cuts a name at NUL and turns backslashes round; what stands in the file counts
    if problem := confined.problem(member.orig_filename.removesuffix("/")):
        return problem
    if kind not in (0, stat.S_IFDIR if member.is_dir() else stat.S_IFREG):
        return "is a link or device"
    if member.flag_bits & ENCRYPTED:
        return "is encrypted"
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        return "is compressed by another method than deflate"
    if member.file_size > LARGEST_MEMBER or (member.is_dir() and member.file_size):
        return f"has {member.file_size} bytes, too many"
    if member.file_size > max(SMALL, STEEPEST * member.compress_size):
        return f"grows from {member.compress_size} to {member.file_size} bytes"
    return None


def _check_content(path: Path, member: zipfile.ZipInfo, archive: zipfile.ZipFile) -> None:
    """Unpack a member into nothing: sizes and checksums that lie come to light."""
    with archive.open(member) as file:
        head = file.read(HEAD)
        while file.read(SMALL):
            pass
    kinds = [kind for magic, kind in NESTED.items() if head.startswith(magic)]
    if head[257:262] == b"ustar":
        kinds.append("tar")
    if kinds:
        raise BundleError(
            f"{path}: member {member.filename!r} is itself an archive ({kinds[0]}); refused"
        )


def write(target: Path, members: Mapping[str, bytes | Path]) -> None:
    """Write an archive; equal members give equal bytes.

    Args:
        target: the file.
        members: what each holds, or the file it is copied from.

    Raises:
        OSError: the disk refuses.
    """
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name)  # of 1980, so that the time does not matter
            info.external_attr = (stat.S_IFREG | 0o644) << 16
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, content if isinstance(content, bytes) else content.read_bytes())

"""The files that hold a folder's records: JSON Lines that grow, and Parquet they are packed to.

``NAME.jsonl`` is appended to. Packing renames it to ``NAME.3.lines``, writes ``NAME.3.parquet``
beside it and removes it. At whatever moment that breaks off, each record is in one place that
counts: lines are left out where the Parquet of their number is there, which appears whole or not.

A packed file is a folder of parts. Each holds the lines as they were, and beside each line the
columns of ``benchmark.records.table``, so that a table needs no line.
"""

import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from itertools import islice, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmark.plumbing import parquet
from benchmark.plumbing.errors import StoreError
from benchmark.records.table import (
    join_tables,
    record_decoder,
    records_table,
    shown_table,
    table_schema,
)

if TYPE_CHECKING:
    import polars

PART = 50_000  # records of one file in a packed folder: what is in memory at a time
FILE = re.compile(r"(?P<name>.*?)(\.(?P<number>\d+)\.(?P<kind>lines|parquet)|\.jsonl)")
LONGEST_LINE = 8 * 2**20  # bytes; a record of one junction has some thousand
LARGEST_PART = 2 * 2**30  # bytes of one file once it is unpacked
MOST_ROWS = 100 * PART  # of one file, a row for each junction
KNOWN = "rightofway columns"  # in the metadata: those of the table when it was packed


def list_files(folder: Path) -> list[Path]:
    """The files that hold records, by name, older ones first.

    Raises:
        StoreError: the folder cannot be read.
    """
    packed: dict[tuple[str, int], Path] = {}
    growing: dict[tuple[str, int], Path] = {}
    try:
        paths = sorted(folder.iterdir()) if folder.is_dir() else []
    except PermissionError as error:
        raise StoreError(f"{error.filename}: cannot read this folder: {error.strerror}") from error
    for path in paths:
        if name := FILE.fullmatch(path.name):
            if name["kind"]:  # sorted, so that Parquet takes the place of its lines
                packed[name["name"], int(name["number"])] = path
            else:
                growing[name["name"], 10**9] = path
    every = packed | growing
    return [every[key] for key in sorted(every)]


def stem_of(path: Path) -> str:
    """What files that hold the records of the same scenarios have in common."""
    name = FILE.fullmatch(path.name)
    return name["name"] if name else path.name


def is_packed(path: Path) -> bool:
    """Whether a file of records is Parquet."""
    return path.suffix == ".parquet"


def size_of(path: Path) -> int:
    """What a file or packed folder takes on the disk [bytes]."""
    parts = _parts(path) if is_packed(path) else [path]
    return sum(part.stat().st_size for part in parts)


def read_lines(path: Path) -> Iterator[bytes]:
    """The lines of a file, with their newlines.

    Raises:
        StoreError: it cannot be read.
    """
    try:
        if is_packed(path):
            for part in _parts(path):
                for line in _column(part, "line"):
                    yield line.encode() + b"\n"
            return
        with path.open("rb") as file:
            while text := file.readline(LONGEST_LINE + 1):
                if len(text) > LONGEST_LINE:
                    raise StoreError(f"{path}: a line of more than {LONGEST_LINE} bytes; no record")
                yield text
    except OSError as error:
        raise StoreError(f"{path}: cannot read records: {error.strerror or error}") from error


def packed_table(path: Path) -> "polars.DataFrame":
    """The table of a packed file.

    Raises:
        StoreError: it cannot be read, or is not what ``pack_lines`` wrote.
    """
    import polars
    from polars.exceptions import PolarsError

    parts = []
    try:
        for part in _parts(path):
            _check_sizes(part)
            known = json.loads(polars.read_parquet_metadata(part).get(KNOWN, "null"))
            if known == [*table_schema()]:
                parts.append(shown_table(polars.read_parquet(part, columns=known)))
            else:  # of another version; the lines tell all
                parts.append(records_table(map(record_decoder().decode, _column(part, "line"))))
    except (OSError, PolarsError, ValueError) as error:
        raise StoreError(
            f"{path}: cannot read packed records: {error}; restore it from a copy"
        ) from error
    return join_tables(parts)


def pack_lines(path: Path, records: Iterable[tuple[bytes, Any]]) -> None:
    """Turn the lines of a file that was set apart into Parquet, and remove it.

    Args:
        path: as ``set_apart`` gives it.
        records: its lines without newlines, and what they say.

    Raises:
        StoreError: the disk refuses, or what was written comes back otherwise; all is as it was.
    """
    draft, target = path.with_suffix(".draft"), path.with_suffix(".parquet")
    try:
        shutil.rmtree(draft, ignore_errors=True)
        draft.mkdir()
        rest, number = iter(records), 0
        while batch := [*islice(rest, PART)]:
            _write_part(draft / f"{number:06}.parquet", batch)
            number += 1
        written = (line for part in _parts(draft) for line in _column(part, "line"))
        for before, after in zip_longest(_whole(path), written):
            if before is None or after is None or before != after.encode():
                raise StoreError(f"{path}: came back otherwise when it was packed; it stays")
        draft.rename(target)
        _sync(target.parent)
        path.unlink()
    except OSError as error:
        shutil.rmtree(draft, ignore_errors=True)
        raise StoreError(
            f"{path}: cannot pack records: {error.strerror or error}; all are still there"
        ) from error


def set_apart(path: Path) -> Path:
    """Let a growing file grow no more; its new path."""
    name = path.name.removesuffix(".jsonl")
    others = filter(None, (FILE.fullmatch(file.name) for file in path.parent.iterdir()))
    numbers = [int(other["number"]) for other in others if other["kind"] and other["name"] == name]
    apart = path.with_name(f"{name}.{max(numbers, default=0) + 1}.lines")
    path.rename(apart)
    _sync(apart.parent)
    return apart


def tidy_folder(folder: Path) -> None:
    """Remove what a break-off left behind: lines that are packed, and drafts."""
    for path in sorted(folder.iterdir()):
        if path.suffix == ".draft":
            shutil.rmtree(path, ignore_errors=True)
        if path.suffix == ".lines" and path.with_suffix(".parquet").exists():
            path.unlink()


def _write_part(part: Path, batch: Iterable[tuple[bytes, Any]]) -> None:
    import polars

    lines, records = zip(*batch, strict=True)
    rows = records_table(records)
    first = rows["record"].is_first_distinct()
    texts = polars.DataFrame(
        {"record": range(len(lines)), "line": [line.decode() for line in lines]}
    )
    # the line stands beside the first of its junctions
    rows = rows.with_columns(first=first).join(
        texts, on="record", how="left", maintain_order="left"
    )
    line = polars.when("first").then("line").alias("line")
    rows.select(*table_schema(), line).write_parquet(
        part, compression="zstd", metadata={KNOWN: json.dumps([*table_schema()])}
    )
    with part.open("rb") as file:
        os.fsync(file.fileno())


def _parts(path: Path) -> list[Path]:
    return sorted(path.glob("*.parquet"))


def _column(part: Path, name: str) -> list[str]:
    import polars

    _check_sizes(part)
    column = polars.read_parquet(part, columns=[name])[name].drop_nulls()
    lengths = column.str.len_bytes().to_numpy()
    if lengths.max(initial=0) > LONGEST_LINE or lengths.sum() > LARGEST_PART:
        raise StoreError(f"{part}: lines that are longer than records")
    values: list[str] = column.to_list()
    return values


def _check_sizes(part: Path) -> None:
    """Refuse what would fill the memory before it is decoded."""
    try:
        sizes = parquet.sizes(part)
    except ValueError as error:
        raise StoreError(
            f"{part}: cannot read packed records: {error}; restore it from a copy"
        ) from error
    if sizes.rows > MOST_ROWS or sizes.decompressed > LARGEST_PART:
        raise StoreError(f"{part}: unpacks to {sizes.rows} rows, {sizes.decompressed} bytes")


def _whole(path: Path) -> Iterator[bytes]:
    stripped = (line.rstrip(b"\n") for line in read_lines(path))
    return (line for line in stripped if line)


def _sync(folder: Path) -> None:
    """Let a rename outlast a power cut, where folders can be synchronised."""
    if os.name == "posix":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

"""Appends and reads records: JSON Lines, one file per scenario, never silently overwritten.

``benchmark.records.files`` knows how they lie on the disk.
"""

import json
import os
import re
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from benchmark.plumbing.errors import StoreError
from benchmark.plumbing.files import prepare_folder, replaced, writing
from benchmark.plumbing.messages import explain
from benchmark.records import files
from benchmark.records.record import Record
from benchmark.records.table import join_tables, record_decoder, records_table

if TYPE_CHECKING:
    import polars

Notice = Callable[[str], None]


class Store:
    """The records of one results folder, in its folder ``records``.

    Args:
        folder: the results folder.
        notice: told what the user should know, such as a half-written line set aside.
    """

    def __init__(self, folder: Path, notice: Notice = lambda message: None) -> None:
        self.folder, self._notice = folder, notice

    @property
    def records_folder(self) -> Path:
        """Where the records lie."""
        return self.folder / "records"

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Keep other commands from writing here meanwhile, and make sure that this one can.

        The lock ends with the process, however that ends.

        Raises:
            StoreError: another command writes here, or the folder cannot be made or written.
        """
        from filelock import FileLock, Timeout

        with writing(self.folder, "records", StoreError, "choose another folder"):
            self.records_folder.mkdir(parents=True, exist_ok=True)
            lock = FileLock(self.records_folder / ".lock")
            try:
                lock.acquire(blocking=False)
            except Timeout:
                raise StoreError(
                    f"{self.folder}: another command is writing records here; let it finish, "
                    "or choose another folder with --out"
                ) from None
            except NotImplementedError:
                self._notice(
                    f"{self.folder}: this file system has no locks; see to it yourself that only "
                    "one command writes here at a time"
                )
        try:
            self.prepare()
            yield
        finally:
            lock.release()

    def prepare(self) -> None:
        """Make sure that records can be written, before any episode is run.

        Raises:
            StoreError: the folder cannot be made or written.
        """
        prepare_folder(self.records_folder, "records")
        for path in self._files():
            if not files.is_packed(path):
                self._set_aside_torn_line(path)

    def append(self, record: Record) -> None:
        """Write a record to the disk before returning.

        Raises:
            StoreError: the disk refuses; the records before stay whole.
        """
        path = self.records_folder / f"{_stem(record.scenario)}.jsonl"
        try:
            # unbuffered: a buffer would write its rest on closing, after the file was cut back
            with path.open("ab", buffering=0) as file:
                start = file.tell()
                try:
                    line = record.line().encode()
                    while line:
                        line = line[file.write(line) :]
                    os.fsync(file.fileno())
                except OSError:
                    os.truncate(path, start)
                    raise
        except OSError as error:
            raise StoreError(
                f"{path}: cannot append a record: {error.strerror}; "
                "those before are whole: make room, and the same command goes on from there"
            ) from error

    def read(self) -> list[Record]:
        """All records, oldest first in each file.

        Raises:
            StoreError: the folder holds no records, or a line is not a record.
        """
        self.require_some()
        return list(self.records())

    def records(self) -> Iterator[Record]:
        """As ``read``, one by one; none where the folder holds none."""
        return (_parse(*line) for path in self._files() for line in self._lines(path))

    def records_of(self, scenarios: Collection[str]) -> Iterator[Record]:
        """As ``records``, those of some scenarios, without a look at the others' files."""
        stems = {_stem(name) for name in scenarios}
        for path in self._files():
            if files.stem_of(path) in stems:
                records = (_parse(*line) for line in self._lines(path))
                yield from (record for record in records if record.scenario in scenarios)

    def table(self, *, empty: bool = False) -> "polars.DataFrame":
        """All records as a table of ``benchmark.records.table``; for a million the only way.

        Args:
            empty: whether a folder without records will do.

        Raises:
            StoreError: as ``read``.
        """
        if not empty:
            self.require_some()
        return join_tables(map(self._table, self._files()))

    def rewrite(self, change: Callable[[Record], Record]) -> None:
        """Change records where they stand; each file whole or not at all.

        Fields that a file does not have, of versions after it, are not added.

        Raises:
            StoreError: the disk refuses, or a file is packed.
        """
        for path in self._files():
            if files.is_packed(path):
                raise StoreError(f"{path}: packed; only records in JSON Lines can be changed")
        for path in self._files():
            lines = [change(_parse(*line)).line(as_read=True) for line in self._lines(path)]
            refusing = writing(path, "records", StoreError, "the old ones are whole")
            with refusing, replaced(path) as draft:
                draft.write_text("".join(lines), encoding="utf-8")

    def compact(self) -> int:
        """Pack all that is JSON Lines into Parquet; how many files there were.

        Nobody else may write here meanwhile: see ``writing``.

        Raises:
            StoreError: a line is not a record, or the disk refuses; nothing is lost.
        """
        growing = [path for path in self._files() if not files.is_packed(path)]
        for path in growing:
            for _ in self._decoded(path):  # what is no record is named before anything moves
                pass
        for path in growing:
            apart = files.set_apart(path) if path.suffix == ".jsonl" else path
            files.pack_lines(apart, self._decoded(apart))
        files.tidy_folder(self.records_folder)
        return len(growing)

    def size(self) -> int:
        """What all records take on the disk [bytes]."""
        return sum(files.size_of(path) for path in self._files())

    @property
    def has_some(self) -> bool:
        """Whether there are files of records."""
        return bool(self._files())

    def require_some(self) -> None:
        """Make sure that there are records.

        Raises:
            StoreError: there are none.
        """
        if not self.has_some:
            raise StoreError(
                f"{self.records_folder}: no records here; make some with "
                f"`rightofway run --out {self.folder}`"
            )

    def _files(self) -> list[Path]:
        return files.list_files(self.records_folder)

    def _lines(self, path: Path) -> Iterator[tuple[bytes, str]]:
        """The lines of a file that say something, without newlines, and where each stands."""
        for number, line in enumerate(files.read_lines(path), start=1):
            if not (text := line.rstrip(b"\n")):
                continue
            if not line.endswith(b"\n") and not _is_whole(line):
                self._notice(f"{path}: the last line is half-written and left out")
                continue
            yield text, f"{path}:{number}"

    def _table(self, path: Path) -> "polars.DataFrame":
        if files.is_packed(path):
            return files.packed_table(path)
        return records_table(record for _, record in self._decoded(path))

    def _decoded(self, path: Path) -> Iterator[tuple[bytes, Any]]:
        """The lines of a file with what they say, which has the attributes of a ``Record``."""
        decode = record_decoder().decode
        for line, place in self._lines(path):
            try:
                yield line, decode(line)
            except (ValueError, RecursionError):  # msgspec's errors, and text that is not UTF-8
                yield line, _parse(line, place)

    def _set_aside_torn_line(self, path: Path) -> None:
        """Move a half-written last line to ``<file>.torn``, so that appending cannot garble it."""
        whole, newline, torn = _bytes(path).rpartition(b"\n")
        if not torn:
            return
        whole_record = _is_whole(torn)  # it only lacks its newline, which an editor may strip
        try:
            if whole_record:
                with path.open("ab") as file:
                    file.write(b"\n")
                return
            with path.with_suffix(".jsonl.torn").open("ab") as aside:
                aside.write(torn + b"\n")
            os.truncate(path, len(whole) + len(newline))
        except OSError as error:
            raise StoreError(f"{path}: cannot mend the last line: {error.strerror}") from error
        self._notice(f"{path}: a half-written last line was set aside in {path.name}.torn")


def _stem(scenario: str) -> str:
    """The name of a scenario's files."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", scenario)


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise StoreError(f"{path}: cannot read records: {error.strerror}") from error


def _is_whole(line: bytes) -> bool:
    try:
        Record.model_validate_json(line)
    except ValidationError:
        return False
    return True


def _parse(line: bytes, place: str) -> Record:
    try:
        return Record.model_validate_json(line)
    except ValidationError as error:
        try:
            version = json.loads(line).get("schema")
        except (ValueError, AttributeError, RecursionError):
            raise StoreError(f"{place}: not a record; remove the line or restore it") from error
        if isinstance(version, int) and version > 1:
            raise StoreError(
                f"{place}: written by a newer Right of Way (schema {version}); upgrade to read it"
            ) from error
        raise StoreError(explain(error, Record, place)) from error

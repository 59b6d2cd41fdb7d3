"""Appends and reads records: JSON Lines, one file per scenario, never silently overwritten."""

import json
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from pydantic import ValidationError

from benchmark.errors import StoreError
from benchmark.record import Record
from benchmark.validation import explain

Notice = Callable[[str], None]


class Store:
    """The records of one results folder, in ``records/*.jsonl``.

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

        with _or_refuse(self.folder):
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
        probe = self.records_folder / ".probe"
        with _or_refuse(self.records_folder):
            self.records_folder.mkdir(parents=True, exist_ok=True)
            probe.write_text("")
            probe.unlink()
        for path in self._files():
            self._set_aside_torn_line(path)

    def append(self, record: Record) -> None:
        """Write a record to the disk before returning.

        Raises:
            StoreError: the disk refuses; the records before stay whole.
        """
        path = self.records_folder / f"{re.sub(r'[^A-Za-z0-9_.-]+', '-', record.scenario)}.jsonl"
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
        if not self._files():
            raise StoreError(
                f"{self.records_folder}: no records here; make some with "
                f"`rightofway run --out {self.folder}`"
            )
        return list(self.records())

    def records(self) -> Iterator[Record]:
        """As ``read``, one by one; none where the folder holds none."""
        return (record for path in self._files() for record in self._lines(path))

    def _files(self) -> list[Path]:
        return sorted(self.records_folder.glob("*.jsonl"))

    def _lines(self, path: Path) -> Iterator[Record]:
        lines = _bytes(path).split(b"\n")
        for number, line in enumerate(lines, start=1):
            if not line:
                continue
            if number == len(lines) and not _is_whole(line):
                self._notice(f"{path}: the last line is half-written and left out")
                continue
            yield _parse(line, f"{path}:{number}")

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


@contextmanager
def _or_refuse(folder: Path) -> Iterator[None]:
    """What the disk refuses names the folder and the option for another."""
    try:
        yield
    except OSError as error:
        raise StoreError(
            f"{folder}: cannot write records: {error.strerror}; choose another folder with --out"
        ) from error


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
        except (ValueError, AttributeError):
            raise StoreError(f"{place}: not a record; remove the line or restore it") from error
        if isinstance(version, int) and version > 1:
            raise StoreError(
                f"{place}: written by a newer Right of Way (schema {version}); upgrade to read it"
            ) from error
        raise StoreError(explain(error, Record, place)) from error

"""What a Parquet file from elsewhere decodes to, told before anything of it is decoded.

Its footer and the headers of its pages are read (Thrift's compact protocol), nothing else.
"""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

MAGIC = b"PAR1"
LARGEST_FOOTER = 16 * 2**20  # bytes
LARGEST_HEADER = 64 * 2**10  # bytes of a page's header, statistics included
DEEPEST = 16  # structures within each other
MOST = 500_000  # values in a footer


@dataclass(frozen=True)
class Sizes:
    """What a file holds once it is decompressed."""

    rows: int
    values: int  # of all columns
    decompressed: int  # bytes of all pages


def sizes(path: Path) -> Sizes:
    """The sizes of a file.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no whole Parquet file, or points to another.
    """
    with path.open("rb") as file:
        end = file.seek(0, 2)
        if end < 12:
            raise ValueError("too short")
        length, magic = struct.unpack("<I4s", _at(file, end - 8, 8))
        if magic != MAGIC or not 0 < length <= min(end - 12, LARGEST_FOOTER):
            raise ValueError("no footer")
        footer = _Compact(_at(file, end - 8 - length, length)).structure()
        values = decompressed = 0
        for group in _list(footer.get(4)):
            for chunk in _list(_dict(group).get(1)):
                if 1 in _dict(chunk):
                    raise ValueError("a column lies in another file")
                more_values, more_bytes = _pages(file, _dict(_dict(chunk).get(3)), end)
                values, decompressed = values + more_values, decompressed + more_bytes
        rows = sum(_count(_dict(group).get(3)) for group in _list(footer.get(4)))
    return Sizes(max(rows, _count(footer.get(3))), values, decompressed)


def _pages(file: BinaryIO, column: dict[int, Any], end: int) -> tuple[int, int]:
    """The values, and the bytes after decompression, of a column's pages."""
    starts = [_count(column[key]) for key in (9, 11) if column.get(key)]
    place = min(starts, default=0)
    last = place + _count(column.get(7))
    if last > end:
        raise ValueError("a column ends behind the file")
    values = decompressed = 0
    while place < last:
        reader = _Compact(_at(file, place, min(LARGEST_HEADER, last - place)))
        header = reader.structure()
        decompressed += _count(header.get(2))
        values += max(_count(_dict(header.get(key, {})).get(1, 0)) for key in (5, 7, 8))
        place += reader.place + _count(header.get(3))
    return max(values, _count(column.get(5))), decompressed


def _at(file: BinaryIO, place: int, length: int) -> bytes:
    file.seek(place)
    return file.read(length)


def _count(value: object) -> int:
    if not isinstance(value, int) or value < 0:
        raise ValueError("a size that is none")
    return value


def _list(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise ValueError("no list where one is expected")
    return value


def _dict(value: object) -> dict[int, Any]:
    if not isinstance(value, dict):
        raise ValueError("no structure where one is expected")
    return value


class _Compact:
    """Reads Thrift's compact protocol: structures become dictionaries by field number."""

    def __init__(self, data: bytes) -> None:
        self._data, self.place, self._left = data, 0, MOST

    def structure(self, depth: int = 0) -> dict[int, Any]:
        fields: dict[int, Any] = {}
        number = 0
        while (head := self._byte()) != 0:
            step, kind = head >> 4, head & 15
            number = number + step if step else self._zigzag()
            fields[number] = kind == 1 if kind in (1, 2) else self._value(kind, depth)
        return fields

    def _value(self, kind: int, depth: int) -> Any:
        self._left -= 1
        if depth > DEEPEST or self._left < 0:
            raise ValueError("too much in a footer")
        if kind in (1, 2):
            return self._byte() == 1
        if kind == 3:
            return self._byte()
        if kind in (4, 5, 6):
            return self._zigzag()
        if kind == 7:
            return self._bytes(8)
        if kind == 8:
            return self._bytes(self._varint())
        if kind in (9, 10):
            return self._items(depth)
        if kind == 11:
            return self._mapping(depth)
        if kind == 12:
            return self.structure(depth + 1)
        raise ValueError(f"no such type: {kind}")

    def _items(self, depth: int) -> list[Any]:
        head = self._byte()
        count = head >> 4 if head >> 4 != 15 else self._varint()
        return [self._value(head & 15, depth + 1) for _ in range(count)]

    def _mapping(self, depth: int) -> None:
        if count := self._varint():
            kinds = self._byte()
            for _ in range(count):
                self._value(kinds >> 4, depth + 1)
                self._value(kinds & 15, depth + 1)

    def _zigzag(self) -> int:
        number = self._varint()
        return (number >> 1) ^ -(number & 1)

    def _varint(self) -> int:
        number = 0
        for shift in range(0, 70, 7):
            byte = self._byte()
            number |= (byte & 127) << shift
            if byte < 128:
                return number
        raise ValueError("a number that does not end")

    def _byte(self) -> int:
        return self._bytes(1)[0]

    def _bytes(self, length: int) -> bytes:
        part = self._data[self.place : self.place + length]
        if len(part) < length:
            raise ValueError("cut off")
        self.place += length
        return part

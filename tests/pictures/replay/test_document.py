"""What a page holds: numbers packed without loss, and what was kept to within its units."""

import base64
import zlib
from collections.abc import Iterable, Iterator

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from benchmark.pictures.replay.document import Document, document, encode
from benchmark.pictures.replay.trajectories import Trajectories


@given(st.lists(st.integers(-(2**40), 2**40)))
def test_numbers_are_packed_without_loss(numbers: list[int]) -> None:
    packed = encode(np.array(numbers, dtype=np.int64))
    assert list(decoded(packed)) == numbers
    assert len(packed) <= 6 * len(numbers)


def test_a_page_holds_what_was_kept_to_within_its_units(kept: Trajectories) -> None:
    packed = document(kept)
    assert packed.record["wall_time"] == 0.0
    assert (packed.vehicles, packed.ground, packed.steps) == (
        kept.vehicles,
        kept.ground,
        kept.steps,
    )
    columns = unpacked(packed)
    for name, unit in (("x", 0.02), ("y", 0.02), ("speed", 0.1), ("acceleration", 0.1)):
        off = np.abs(columns[name] - getattr(kept.tracks, name))
        assert off.max() <= unit / 2 + 1e-9
    assert (columns["told"] == kept.tracks.told).all()
    (curves,) = kept.curves
    absent = np.isnan(curves.movement_waiting.ravel())
    assert absent.any()
    assert (columns["0.movement_waiting"][absent] < 0).all()
    off = columns["0.movement_waiting"] - curves.movement_waiting.ravel()
    assert np.abs(off[~absent]).max() <= 0.1 / 2 + 1e-9


def unpacked(packed: Document) -> dict[str, np.ndarray]:
    """The columns of a document, as ``page/unpack.js`` reads them."""
    numbers = decoded(zlib.decompress(base64.b64decode(packed.data), wbits=-15))
    columns = {}
    for column in packed.columns:
        whole = np.fromiter(numbers, dtype=np.int64, count=column.count)
        for _ in range(column.order):
            whole = np.cumsum(whole)
        columns[column.name] = whole * column.unit
    assert not list(numbers)
    return columns


def decoded(data: Iterable[int]) -> Iterator[int]:
    """Whole numbers from bytes, one byte after the other."""
    number = place = 0
    for byte in data:
        number |= (byte & 127) << place
        place += 7
        if byte < 128:
            yield number >> 1 ^ -(number & 1)
            number = place = 0
    assert place == 0

"""What a page holds: numbers packed without loss, and what was kept to within its units."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmark.pictures.replay import varints
from benchmark.pictures.replay.document import document, trajectories
from benchmark.pictures.replay.trajectories import Trajectories


@given(st.lists(st.integers(-(2**40), 2**40)))
def test_numbers_are_packed_without_loss(numbers: list[int]) -> None:
    packed = varints.encode(np.array(numbers, dtype=np.int64))
    assert varints.decode(packed).tolist() == numbers
    assert len(packed) <= 6 * len(numbers)


@pytest.mark.parametrize("data", [b"\x80", b"\x01\xff", b"\xff" * 12 + b"\x01"])
def test_numbers_that_are_cut_off_or_too_long_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"cut off|too long"):
        varints.decode(data)


def test_a_page_holds_what_was_kept_to_within_its_units(kept: Trajectories) -> None:
    found = trajectories(document(kept))
    assert found.record == kept.record.model_copy(update={"wall_time": 0.0})
    assert (found.vehicles, found.ground, found.steps) == (kept.vehicles, kept.ground, kept.steps)
    for name, unit in (("x", 0.02), ("y", 0.02), ("speed", 0.1), ("acceleration", 0.1)):
        off = np.abs(getattr(found.tracks, name) - getattr(kept.tracks, name))
        assert off.max() <= unit / 2 + 1e-9
    assert (found.tracks.told == kept.tracks.told).all()
    again = trajectories(document(found))  # rounded numbers stay as they are
    assert (again.tracks.x == found.tracks.x).all()

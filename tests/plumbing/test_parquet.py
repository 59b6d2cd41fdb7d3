"""What a Parquet file decodes to is told before it is decoded."""

import contextlib
from pathlib import Path

import polars
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmark.plumbing import parquet


def test_a_bomb_is_told_by_its_rows(tmp_path: Path) -> None:
    path = tmp_path / "bomb.parquet"
    polars.DataFrame({"a": polars.repeat("x" * 900, 3_000_000, eager=True)}).write_parquet(path)
    sizes = parquet.sizes(path)
    assert path.stat().st_size < 40_000
    assert sizes.rows == 3_000_000
    assert sizes.values >= 3_000_000


def test_sizes_are_those_of_the_pages(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    rows = polars.DataFrame({"a": range(1000), "b": [f"{number:0100}" for number in range(1000)]})
    for compression in ("uncompressed", "zstd", "snappy"):
        rows.write_parquet(path, compression=compression, metadata={"k": "v" * 1000})
        sizes = parquet.sizes(path)
        assert sizes.rows == 1000
        assert 100_000 < sizes.decompressed < 250_000


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1" + bytes(20) + b"PAR1", b"x" * 100])
def test_what_is_no_parquet_is_an_error_of_one_kind(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(ValueError):  # noqa: PT011 - whoever reads the file names it
        parquet.sizes(tmp_path / "a")


@given(place=st.integers(0, 600), byte=st.integers(0, 255))
def test_a_changed_byte_never_ends_otherwise(
    tmp_path_factory: pytest.TempPathFactory, place: int, byte: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "changed.parquet"
    polars.DataFrame({"a": [1, 2], "b": ["x", "y"]}).write_parquet(path)
    content = bytearray(path.read_bytes())
    content[place % len(content)] = byte
    path.write_bytes(content)
    with contextlib.suppress(ValueError):
        parquet.sizes(path)

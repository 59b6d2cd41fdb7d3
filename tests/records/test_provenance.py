"""Provenance comes back from its file."""

from pathlib import Path

from factories.comparisons import MADE

from benchmark.records import provenance


def test_provenance_comes_back_from_its_file(tmp_path: Path) -> None:
    for made in (MADE, MADE.model_copy(update={"git": None})):
        (tmp_path / "reference.toml").write_text(made.as_toml(), encoding="utf-8")
        assert provenance.read_provenance(tmp_path / "reference.toml") == made

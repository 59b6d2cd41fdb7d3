"""Weights that can run code have no place in a bundle."""

from pathlib import Path

import numpy as np
import pytest

from benchmark.admission.submission import contents


def test_weights_that_run_code_when_they_are_loaded_are_told_by_content(tmp_path: Path) -> None:
    def problem(name: str, content: bytes) -> str | None:
        (tmp_path / name).write_bytes(content)
        return contents.content_problem(tmp_path / name)

    np.save(tmp_path / "a.npy", np.array([{}], dtype=object), allow_pickle=True)
    assert "pickled objects" in (contents.content_problem(tmp_path / "a.npy") or "")
    np.save(tmp_path / "b.npy", np.zeros(3))
    assert contents.content_problem(tmp_path / "b.npy") is None
    assert "no array" in (problem("c.npy", b"hello") or "")
    assert "not a whole safetensors file" in (problem("d.safetensors", b"hello") or "")
    assert "is a pickle" in (problem("e.txt", b"\x80\x05.") or "")
    assert "tensors in another file" in (problem("f.onnx", b"..\x0a\x08location\x12\x0b../x") or "")
    assert problem("g.onnx", b"\x08\x08 allocation") is None
    assert problem("h.py", b"import pickle") is None


@pytest.mark.parametrize("name", ["a.pt", "a.PKL", "a.npz", "a.h5", "a.joblib", "x/a.ckpt"])
def test_formats_that_can_run_code_have_no_place_in_a_bundle(name: str) -> None:
    for folder in ("code", "weights", "records"):
        assert "can run code when it is loaded" in (
            contents.place_problem(f"{folder}/{name}") or ""
        )

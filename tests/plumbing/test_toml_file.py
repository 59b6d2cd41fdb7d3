"""TOML from elsewhere costs neither minutes nor memory."""

from pathlib import Path

import pytest

from benchmark.plumbing import toml_file
from benchmark.plumbing.errors import SuiteError


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (".".join("a" * 40_000) + " = 1", "a key of more than 64 parts"),
        (".".join(['"a b"'] * 3000) + " = 1", "a key of more than 64 parts"),
        ("[" + " . ".join(["a"] * 3000) + "]", "a key of more than 64 parts"),
        ("a = " + "[" * 3000 + "]" * 3000, "not valid TOML"),
        ("a = " + "[" * 80 + "]" * 80, "more than 64 deep"),
        ("a = " + "{b = " * 80 + "1" + "}" * 80, "more than 64 deep"),
        ("a = 1" + "0" * 5000, "not valid TOML"),
        ("a = '" + "x" * 2**22 + "'", "has more than 4194304 bytes"),
    ],
    ids=range(8),
)
def test_a_bomb_is_one_message(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(SuiteError) as caught:
        toml_file.read(tmp_path / "a.toml", SuiteError)
    assert said in str(caught.value)


def test_dots_in_texts_are_no_keys(tmp_path: Path) -> None:
    words = "a." * 50 + "1"
    (tmp_path / "a.toml").write_text(f"sources = ['{words}', '{words}']\r\nb.c.d = 1.5\r\n")
    assert toml_file.read(tmp_path / "a.toml", SuiteError) == {
        "sources": [words, words],
        "b": {"c": {"d": 1.5}},
    }

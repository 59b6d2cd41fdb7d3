"""Text from elsewhere has no effect on a terminal, and what it would do is seen."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmark.plumbing.plain import UNSEEN, shown


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("\x1b[2Jaccepted", r"\x1b[2Jaccepted"),
        ("a\x9b2K", r"a\x9b2K"),
        ("a\u202egnp.exe", r"a\u202egnp.exe"),
        ("a\u200bb\u2066c\ufeff", r"a\u200bb\u2066c\ufeff"),
        ("a\nb\rc\x00\x7f", r"a\nb\rc\x00\x7f"),
        ("a\u2028b\U000e0041", r"a\u2028b\U000e0041"),
        ("Müller, 東京, π ≤ 4 s", "Müller, 東京, π ≤ 4 s"),
        ("10\u00a0%", "10\u00a0%"),
    ],
)
def test_what_steers_a_terminal_is_seen(text: str, plain: str) -> None:
    assert shown(text) == plain


def test_newlines_may_stay() -> None:
    assert shown("a\nb\x1b", keep="\n") == "a\nb\\x1b"


@given(st.text())
def test_shown_text_shows_itself_and_can_be_printed(text: str) -> None:
    plain = shown(text)
    assert shown(plain) == plain
    assert not re.search("[\x00-\x1f\x7f-\x9f\u200b-\u200f\u202a-\u202e\u2066-\u2069]", plain)


def test_the_pattern_for_tables_finds_what_is_changed() -> None:
    import polars

    signs = [chr(code) for code in range(0x11000) if not 0xD800 <= code < 0xE000]
    found = polars.Series(signs).str.contains(UNSEEN).to_list()
    assert found == [shown(sign) != sign for sign in signs]

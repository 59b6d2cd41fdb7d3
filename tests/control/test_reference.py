"""References to controllers as text: three forms, options, TOML tables."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmark.control import reference
from benchmark.control.reference import Reference
from benchmark.plumbing.errors import ControllerError


@pytest.mark.parametrize(
    ("text", "parts", "label"),
    [
        ("virtual-signal", Reference("virtual-signal"), "virtual-signal"),
        ("v?a=1&b=2", Reference("v", "", "a=1&b=2"), "v?a=1&b=2"),
        ("v?", Reference("v"), "v"),
        ("a/b.py:Mine", Reference("a/b.py", "Mine"), "b.py:Mine"),
        ("/a/b.c/d.py:Mine?x=1", Reference("/a/b.c/d.py", "Mine", "x=1"), "d.py:Mine?x=1"),
        (r"C:\a\b.py:Mine", Reference(r"C:\a\b.py", "Mine"), "b.py:Mine"),
        ("b.py:Outer.Inner", Reference("b.py", "Outer.Inner"), "b.py:Outer.Inner"),
        ("pkg.mod:Mine?x=1", Reference("pkg.mod", "Mine", "x=1"), "pkg.mod:Mine?x=1"),
        ("v?x=b.py:Mine", Reference("v", "", "x=b.py:Mine"), "v?x=b.py:Mine"),
        ("b.py:M?x=c.py:N", Reference("b.py", "M", "x=c.py:N"), "b.py:M?x=c.py:N"),
    ],
)
def test_a_reference_has_three_forms_and_a_label_without_folders(
    text: str, parts: Reference, label: str
) -> None:
    assert reference.parse(text) == parts
    assert reference.label(text) == label


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a/b.py", 'a/b.py": which class? Expected a/b.py:MyController'),
        ("a/b.py?x=1", "which class?"),
        ("a/b.py:", 'b.py:": "" cannot be a class; expected a/b.py:MyController'),
        ("b.py:My-Class", '"My-Class" cannot be a class'),
        ("pkg:2nd", '"2nd" cannot be a class'),
        ("pkg/mod:Mine", "names no controller; expected NAME, path/to/file.py:Class or package"),
        ("", '"" names no controller'),
        ("?x=1", "names no controller"),
        (":Mine", "names no controller"),
    ],
)
def test_text_of_no_form_is_refused_with_the_forms(text: str, message: str) -> None:
    with pytest.raises(ControllerError, match=re.escape(message)):
        reference.parse(text)


def test_a_files_place_is_counted_from_a_folder_and_a_name_has_none() -> None:
    found = [
        str(reference.parse(one).placed(Path("/a/b"))) for one in ("../c.py:M?x=1", "v", "p:M")
    ]
    assert found == ["/a/c.py:M?x=1", "v", "p:M"]
    assert str(reference.parse("~/c.py:M").placed(Path())) == f"{Path.home()}/c.py:M"


words = st.from_regex(r"[a-z][a-z_]{0,8}", fullmatch=True)
values = st.one_of(st.booleans(), st.integers(), st.text(max_size=12))


@given(options=st.dictionaries(words, values, max_size=4))
def test_options_survive_being_written_and_read(options: dict[str, object]) -> None:
    written = Reference("v", "", reference.query(options))
    as_text = {k: str(v).lower() if isinstance(v, bool) else str(v) for k, v in options.items()}
    assert reference.parse(str(written)).options() == dict(sorted(as_text.items()))


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"name": "virtual-signal"}, "virtual-signal"),
        ({"name": "virtual-signal", "clearance": 4}, "virtual-signal?clearance=4"),
        ({"name": "a/b.py:Mine", "x": 2.0, "y": True}, "a/b.py:Mine?x=2&y=true"),
        ({"name": "v", "word": "a&b=c d"}, "v?word=a%26b%3Dc%20d"),
    ],
)
def test_a_table_is_a_reference(table: dict[str, object], text: str) -> None:
    assert reference.from_table(table) == text


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"clearance": 4}, "expected a table such as { name = "),
        ({"name": 4}, "expected a table such as { name = "),
        ({"name": "v?x=1", "y": 2}, "in a table options are keys"),
        ({"name": "v", "x": [1]}, "x: expected a number, a text, true or false; got [1]"),
        ({"name": "b.py"}, "which class?"),
    ],
)
def test_a_table_that_makes_no_sense_is_refused(table: dict[str, object], message: str) -> None:
    with pytest.raises(ControllerError, match=re.escape(message)):
        reference.from_table(table)

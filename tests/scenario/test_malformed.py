"""Whatever lies in a file that a user hands in: one message that names it, and no traceback."""

from collections.abc import Callable
from pathlib import Path

import pytest
import tomli_w
from factories.scenarios import edited

from benchmark.plumbing.errors import RightOfWayError
from benchmark.records.store import Store
from benchmark.scenario.scenario import load_scenario
from benchmark.study.suite import load_suite

GOOD = tomli_w.dumps(edited()).encode()
SUITE = b'scenarios = ["smoke"]\ncontrollers = ["first-come"]\nseeds = 2\n'
CONTENTS = {
    "empty": b"",
    "binary": bytes(range(256)),
    "NULs": b"\0" * 4096,
    "half a key": b"sche",
    "no TOML": b"{]",
    "UTF-16": "schema = 1".encode("utf-16"),
    "a key twice": b"seeds = 1\nseeds = 2\n",
    "a table as a number": b"[seeds]\nx = 1\n",
    "nan": b"seeds = nan\n",
    "infinite": b"seeds = inf\n",
    "a date": b"seeds = 2020-01-01\n",
    "negative": b"seeds = -1\n",
    "unknown keys": b"sed = 1\n",
    "deep": b"x = " + b"[" * 500 + b"]" * 500 + b"\n",
}
READERS: dict[str, Callable[[Path], object]] = {"scenario": load_scenario, "suite": load_suite}


@pytest.mark.parametrize("content", CONTENTS)
@pytest.mark.parametrize("kind", READERS)
def test_a_file_that_is_none_is_refused_by_its_name(
    tmp_path: Path, kind: str, content: str
) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(CONTENTS[content])
    with pytest.raises(RightOfWayError, match=r"a\.toml"):
        READERS[kind](path)


@pytest.mark.parametrize("kind", READERS)
def test_a_folder_in_the_place_of_a_file_is_refused(tmp_path: Path, kind: str) -> None:
    (tmp_path / "a.toml").mkdir()
    with pytest.raises(RightOfWayError, match=r"a\.toml"):
        READERS[kind](tmp_path / "a.toml")


@pytest.mark.parametrize(("kind", "good"), [("scenario", GOOD), ("suite", SUITE)])
def test_lines_that_end_as_on_windows_are_read(tmp_path: Path, kind: str, good: bytes) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(good.replace(b"\n", b"\r\n"))
    READERS[kind](path)


@pytest.mark.parametrize(
    "content", [b"\xff\xfe{}\n", b"{}\n", b"[]\n", b"nothing\n", b'{"schema": 2}\n', b"[" * 9999]
)
def test_a_line_that_is_no_record_is_refused_by_its_place(tmp_path: Path, content: bytes) -> None:
    folder = tmp_path / "records"
    folder.mkdir()
    (folder / "a.jsonl").write_bytes(content.rstrip(b"\n") + b"\n")
    with pytest.raises(RightOfWayError, match=r"a\.jsonl:1"):
        Store(tmp_path).table()

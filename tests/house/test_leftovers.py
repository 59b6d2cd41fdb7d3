"""No test's outcome depends on another: what one leaves behind in the process is put back."""

import os
import signal
import sys
from pathlib import Path

import pytest
from factories.leftovers import put_back
from plugins import install

from benchmark.control import plugins


def test_path_modules_variables_folder_and_signals_are_put_back(tmp_path: Path) -> None:
    before = [*sys.path], Path.cwd(), dict(os.environ), signal.getsignal(signal.SIGTERM)
    found = []
    for folder in (tmp_path / "first", tmp_path / "second"):
        folder.mkdir()
        (folder / "same_name.py").write_text(f"folder = {folder.name!r}")
        with put_back(tmp_path):
            sys.path.insert(0, str(folder))
            os.chdir(folder)
            os.environ["LEFT_BEHIND"] = "1"
            del os.environ["PATH"]
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            found.append(__import__("same_name").folder)
        assert "same_name" not in sys.modules
        assert before == (
            [*sys.path],
            Path.cwd(),
            dict(os.environ),
            signal.getsignal(signal.SIGTERM),
        )
    assert found == ["first", "second"]


def test_what_a_wider_fixture_has_put_on_the_path_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "stays.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    with put_back(tmp_path):
        module = __import__("stays")
    assert sys.modules["stays"] is module


def test_controllers_of_a_folder_that_is_gone_are_not_known_any_more(tmp_path: Path) -> None:
    with put_back(tmp_path):
        sys.path.insert(0, install(tmp_path / "site"))
        plugins.discovered.cache_clear()
        assert "crashes" in plugins.discovered()
    assert "crashes" not in plugins.discovered()

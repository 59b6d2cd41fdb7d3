"""Fixtures of the whole suite."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from factories import leftovers
from factories.processes import PATIENCE
from factories.scenarios import ROOT
from hypothesis import settings

pytest_plugins = ["browser"]  # fixtures: pages in Chromium

settings.register_profile("suite", deadline=None, derandomize=True)
settings.load_profile("suite")


@pytest.fixture(scope="session", autouse=True)
def _ctrl_c() -> None:
    """Processes that tests start hear Ctrl-C, even where this one was started not to."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session", autouse=True)
def _cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """One cache for all worker processes of this run, away from the user's."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RIGHTOFWAY_CACHE", str(base / "rightofway-cache"))
        yield


@pytest.fixture(autouse=True)
def _leftovers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No test's outcome depends on what another has left behind in this process."""
    with leftovers.put_back(tmp_path_factory.getbasetemp()):
        yield


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel and the source distribution."""
    folder = tmp_path_factory.mktemp("dist")
    whole = [sys.executable, "-m", "hatchling", "build", "-d", str(folder)]
    done = subprocess.run(whole, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, empty."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def without_workers() -> Iterator[None]:
    """Episodes run in this process."""
    from factories import workers

    with workers.without_workers():
        yield

"""Subcommands of plugins."""

import subprocess
import sys
from pathlib import Path

import pytest
from factories.command_line import rightofway
from factories.processes import PATIENCE

PLUGIN = '''
import typer

def greet(name: str) -> None:
    """Greet somebody."""
    typer.echo(f"hello, {name}")
'''


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a plugin, as an installer leaves it, on the path."""
    (tmp_path / "greetings.py").write_text(PLUGIN)
    about = tmp_path / "greetings-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: greetings\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[rightofway.commands]\n"
        "greet = greetings:greet\nlist = greetings:greet\nlost = greetings.nowhere:lost\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_a_plugins_subcommand_runs_and_stands_in_the_help(installed: Path) -> None:
    assert rightofway(installed, "greet", "Ada").stdout == "hello, Ada\n"
    lines = [line.split() for line in rightofway(installed, "--help").stdout.splitlines()]
    assert ["greet", "Greet", "somebody."] in lines
    assert any(line[:1] == ["paper"] for line in lines)


def test_own_subcommands_stay_what_they_are(installed: Path) -> None:
    done = rightofway(installed, "list")
    assert (done.returncode, "hello" in done.stdout) == (0, False)


def test_a_plugin_that_cannot_be_loaded_stops_only_its_own_subcommand(installed: Path) -> None:
    done = rightofway(installed, "lost")
    assert done.returncode == 2
    assert "the plugin greetings.nowhere:lost cannot be loaded" in " ".join(done.stderr.split())
    assert rightofway(installed, "schema").returncode == 0


def test_a_mistyped_plugin_is_suggested(installed: Path) -> None:
    done = rightofway(installed, "greeet")
    assert done.returncode == 2
    assert "'greet'" in done.stderr


def test_own_subcommands_start_without_a_look_at_plugins() -> None:
    code = (
        "import sys; from benchmark.commands.app import app; sys.argv = ['rightofway', 'schema'];"
        "app(standalone_mode=False); assert 'baselines' not in sys.modules"
    )
    subprocess.run(
        [sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL, timeout=PATIENCE
    )

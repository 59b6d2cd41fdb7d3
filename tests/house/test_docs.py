"""Docs point to what is there: files, modules, public names and commands."""

import pkgutil
import re
from pathlib import Path

import pytest
from factories.scenarios import ROOT
from typer.main import get_command

import benchmark
from benchmark.commands.app import app

PAGES = sorted(
    [ROOT / name for name in ("README.md", "CONTRIBUTING.md")]
    + [*(ROOT / "docs").glob("*.md"), *(ROOT / "baselines").glob("*/README.md")]
)
pytestmark = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def test_a_link_leads_to_a_file(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text("utf-8")):
        assert "://" in target or (page.parent / target).exists(), target


def test_a_path_that_is_named_exists(page: Path) -> None:
    roots = "benchmark|baselines|tests|docs"
    for path in re.findall(rf"`((?:{roots})/[\w./*-]*)`", page.read_text("utf-8")):
        assert list(ROOT.glob(path)), path


def test_a_module_that_is_named_exists(page: Path) -> None:
    text = page.read_text("utf-8")
    names = re.findall(r"\b((?:benchmark|baselines)(?:\.\w+)+)", text)
    for name in names:
        if not name.endswith((".py", ".md", ".toml", ".zip")):
            pkgutil.resolve_name(name)


def test_what_is_imported_from_the_library_is_public(page: Path) -> None:
    for names in re.findall(r"^from benchmark import (.+)$", page.read_text("utf-8"), re.MULTILINE):
        assert {name.strip() for name in names.split(",")} <= set(dir(benchmark))


def test_a_command_that_is_named_exists(page: Path) -> None:
    known = set(get_command(app).list_commands(None))  # type: ignore[attr-defined]
    assert set(re.findall(r"`rightofway ([a-z][\w-]*)", page.read_text("utf-8"))) <= known

"""Contents -> a folder of pages: rendered beside the old site, then put in its place."""

import shutil
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from benchmark import __version__
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.files import replaced, writing
from benchmark.reports import tables
from benchmark.reports.site import charts, citation
from benchmark.reports.site.contents import Contents
from benchmark.reports.site.pages import Page, pages
from benchmark.reports.site.rendering import site_environment

MARK = "rightofway-site.txt"
MARK_WORDS = "Made by `rightofway site`, which replaces this whole folder.\n"


def check_target(folder: Path) -> None:
    """Make sure that a folder can hold the site, before anything is worked out.

    Raises:
        UsageError: it is a file, or holds something that is no site and would be lost.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: is a file; choose another folder with --output")
    names = sorted(path.name for path in folder.iterdir()) if folder.exists() else []
    if names and MARK not in names:
        raise UsageError(
            f"{folder}: holds {names[0]} and is no site that could be replaced; "
            "choose another folder with --output"
        )


def build_site(contents: Contents, folder: Path) -> int:
    """Write the site; the old one stays whole until the new one is. Returns the pages' number.

    The same contents give the same bytes.

    Raises:
        UsageError: as ``check_target``, or the disk refuses.
    """
    check_target(folder)
    with writing(folder, "the site", remedy="choose another folder with --output"):
        folder.parent.mkdir(parents=True, exist_ok=True)
        with replaced(folder) as draft:
            return _fill(contents, draft)


def _fill(contents: Contents, folder: Path) -> int:
    folder.mkdir()
    _write(folder / MARK, MARK_WORDS)
    shutil.copytree(str(files("benchmark.reports.site") / "static"), folder / "assets")
    _write(folder / "assets" / "vega.js", charts.vega_script())
    _write_downloads(contents, folder)
    for replay in contents.replays:
        (folder / replay.address).parent.mkdir(exist_ok=True)
        shutil.copyfile(replay.path, folder / replay.address)
    jinja = site_environment(contents)
    count = 0
    for page in pages(contents):
        _write(folder / page.address, jinja.get_template(page.template).render(_frame(page)))
        count += 1
    return count


def _frame(page: Page) -> Mapping[str, Any]:
    return {**page.facts, "root": "../" * page.address.count("/"), "address": page.address}


def _write_downloads(contents: Contents, folder: Path) -> None:
    _write(folder / "data" / "leaderboard.csv", tables.leaderboard_csv(contents.rows))
    for name, rows in contents.scenarios.items():
        _write(folder / contents.addresses.table(name), tables.leaderboard_csv(rows))
        scenario_hash = rows[0].scenario_hash
        if scenario := contents.files.get(scenario_hash):
            _write(
                folder / contents.addresses.citation(name),
                citation.bibtex_entry(scenario, __version__),
            )
        for panel, drawing in contents.drawings.get(scenario_hash, {}).items():
            _write(folder / contents.addresses.drawing(name, panel), drawing)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text.encode(errors="replace"))

"""The fixtures of browser.py see what they are to see."""

import subprocess
import sys
from pathlib import Path

from browser import Visit, accessibility_violations, wider_than_its_window
from factories.scenarios import ROOT

PAGE = """<!doctype html><html lang="en"><title>A page</title><main><h1>A page</h1>{}</main>"""


def write(folder: Path, body: str) -> Path:
    page = folder / "page.html"
    page.write_text(PAGE.format(body))
    return page


def test_a_page_without_fault_has_no_troubles(visit: Visit, tmp_path: Path) -> None:
    page = visit(write(tmp_path, "<p>Hello"))
    assert page.title() == "A page"
    assert accessibility_violations(page) == []
    assert not wider_than_its_window(page)
    assert len(visit.requests) == 1


def test_errors_of_scripts_and_of_the_console_are_noted(visit: Visit, tmp_path: Path) -> None:
    visit(write(tmp_path, "<script>console.error('oh'); throw Error('no')</script>"))
    assert visit.troubles == ["console error: oh", "failed: no"]
    visit.troubles.clear()


def test_requests_that_leave_the_page_are_noted_and_stopped(visit: Visit, tmp_path: Path) -> None:
    body = '<img src="https://example.org/a.png" alt=""><img src="beside.png" alt="">'
    visit(write(tmp_path, body))
    asked = [line for line in visit.troubles if line.startswith("requested")]
    beside = (tmp_path / "beside.png").as_uri()
    assert sorted(asked) == [f"requested {beside}", "requested https://example.org/a.png"]
    visit.troubles.clear()


def test_files_of_the_named_folder_may_be_requested(visit: Visit, tmp_path: Path) -> None:
    (tmp_path / "beside.js").write_text("document.title = 'changed'")
    page = visit(write(tmp_path, '<script src="beside.js"></script>'), within=tmp_path)
    assert page.title() == "changed"
    assert len(visit.requests) == 2


def test_axe_finds_what_is_wrong(visit: Visit, tmp_path: Path) -> None:
    page = visit(write(tmp_path, '<img src="data:,">'))
    (violation,) = accessibility_violations(page)
    assert violation.startswith("image-alt (critical)")


def test_a_page_wider_than_a_phone_is_seen(visit: Visit, tmp_path: Path) -> None:
    page = visit(write(tmp_path, '<div style="width: 900px">wide</div>'), phone=True)
    assert wider_than_its_window(page)


USES_A_BROWSER = "from browser import *\ndef test_it(chromium): pass\n"


def run_without_chromium(folder: Path, **variables: str) -> str:
    test = folder / "test_one.py"
    test.write_text(USES_A_BROWSER)
    here = str(ROOT / "tests")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-rs", "-p", "no:cacheprovider", str(test)],
        env={"PATH": "", "PYTHONPATH": here, **variables},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout


def test_without_a_browser_tests_say_why_they_are_skipped(tmp_path: Path) -> None:
    said = run_without_chromium(tmp_path)
    assert "1 skipped" in said
    assert "no Chromium on this machine" in said


def test_where_a_browser_is_needed_its_absence_fails(tmp_path: Path) -> None:
    said = run_without_chromium(tmp_path, RIGHTOFWAY_TESTS_NEED_CHROMIUM="1")
    assert "1 error" in said
    assert "apt-get install chromium" in said

"""The fixtures of browser.py see what they are to see."""

from pathlib import Path

import browser
import pytest
from browser import Visit, accessibility_violations, wider_than_its_window

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


@pytest.mark.parametrize(
    ("needed", "ending"), [("", pytest.skip.Exception), ("1", pytest.fail.Exception)]
)
def test_without_a_browser_tests_are_skipped_or_fail_where_it_is_needed(
    monkeypatch: pytest.MonkeyPatch, needed: str, ending: type[BaseException]
) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CHROMIUM", raising=False)
    monkeypatch.setenv("RIGHTOFWAY_TESTS_NEED_CHROMIUM", needed)
    with pytest.raises(ending, match=r"no Chromium on this machine.*apt-get install chromium"):
        browser.required_program()

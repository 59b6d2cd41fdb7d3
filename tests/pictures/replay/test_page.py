"""The page that plays an episode, as a reader meets it: in Chromium, from a file, no network."""

import dataclasses
import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from browser import PATIENCE, Visit, accessibility_violations, wider_than_its_window
from factories.episodes import CROSSING
from msgspec.structs import replace
from playwright.sync_api import Page, expect

from benchmark.pictures.replay.page import page
from benchmark.pictures.replay.replay import Replay, recorded
from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.records.record import Record
from benchmark.scenario import catalogue
from benchmark.study.episode import Episode

ONE = Episode(catalogue.find_scenario("smoke/crossing@3000"), "virtual-signal", 0.5, 1)
EVIL = "<script>document.title = 'caught'</script>"


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Replay.of(ONE).write(tmp_path_factory.mktemp("one") / "replay.html")


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    lights = dataclasses.replace(ONE, controller="traffic-light", rate=None)
    return Replay.of(ONE, lights).write(tmp_path_factory.mktemp("two") / "replay.html")


def at(page: Page) -> float:
    """Where the slider stands [steps]."""
    return float(page.locator("#time").input_value())


def wait(page: Page, condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE / 1000
    while not condition():
        assert time.monotonic() < deadline
        page.wait_for_timeout(20)


def until(page: Page, steps: float) -> None:
    """Wait until the slider is past a step."""
    wait(page, lambda: at(page) > steps)


def ready(page: Page) -> Page:
    expect(page.locator("[data-figure=vehicles]").first).to_have_text(re.compile(r"\d"))
    return page


def picture(page: Page) -> bytes:
    return page.locator("canvas").nth(1).screenshot()


def changed(page: Page, before: bytes) -> bytes:
    """Wait for another picture."""
    wait(page, lambda: picture(page) != before)
    return picture(page)


def test_it_plays_and_pauses_and_time_goes_on(visit: Visit, single: Path) -> None:
    page = ready(visit(single))
    assert at(page) == 29  # where the warm-up ends
    page.get_by_role("button", name="Play").click()
    until(page, 32)
    page.get_by_role("button", name="Pause").click()
    stopped = at(page)
    page.wait_for_timeout(150)
    assert at(page) == stopped
    minutes, seconds = page.locator("#now").inner_text().split(":")
    assert 60 * int(minutes) + int(seconds) == pytest.approx(stopped + 1, abs=1)


def test_the_slider_goes_anywhere_and_the_figures_with_it(visit: Visit, single: Path) -> None:
    page = ready(visit(single))
    before = picture(page)
    page.locator("#time").fill("109")
    expect(page.locator("#now")).to_have_text("01:50")
    expect(page.locator("[data-figure=passed]")).not_to_have_text("0")
    changed(page, before)


def test_keys_steer_everything(visit: Visit, single: Path) -> None:
    page = ready(visit(single))
    for key, wanted in (
        *(("ArrowRight", 30), ("Shift+ArrowRight", 40), ("ArrowLeft", 39)),
        *(("End", 119), ("Home", 0)),
    ):
        page.keyboard.press(key)
        expect(page.locator("#time")).to_have_value(str(wanted))
    page.keyboard.press(">")
    expect(page.locator("#speed")).to_have_value("8")
    for _ in range(3):
        page.keyboard.press("<")  # so slow that it will not come to its end
    page.keyboard.press(" ")
    until(page, 2)
    page.keyboard.press("k")
    expect(page.get_by_role("button", name="Play")).to_be_visible()


def test_a_vehicle_is_followed_and_let_go(visit: Visit, single: Path) -> None:
    page = ready(visit(single))
    page.locator("#time").fill("60")
    before = picture(page)
    page.keyboard.press("f")
    expect(page.locator("#follow")).not_to_have_value("")
    expect(page.locator("[data-figure=followed]")).to_contain_text(
        page.locator("#follow").input_value()
    )
    changed(page, before)
    page.keyboard.press("Escape")
    expect(page.locator("#follow")).to_have_value("")
    page.locator("#follow").fill("nobody")
    page.locator("#follow").press("Enter")
    expect(page.locator("#said")).to_contain_text("There is no vehicle nobody")


def test_the_view_is_dragged_and_zoomed_and_fits_again(visit: Visit, single: Path) -> None:
    page = ready(visit(single))
    whole = picture(page)
    box = page.locator("canvas").nth(1).bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 200, box["y"] + 200)
    page.mouse.wheel(0, -400)
    near = changed(page, whole)
    page.mouse.down()
    page.mouse.move(box["x"] + 320, box["y"] + 240, steps=4)
    page.mouse.up()
    assert changed(page, near) != whole
    page.get_by_role("button", name="Fit").click()
    wait(page, lambda: picture(page) == whole)


def test_a_moment_is_shared_by_its_address(visit: Visit, single: Path) -> None:
    page = ready(visit(f"{single.resolve().as_uri()}#t=42.0&zoom=2"))
    expect(page.locator("#now")).to_have_text("00:42")
    page.locator("#time").fill("59")
    expect(page).to_have_url(re.compile(r"#t=60\.0&zoom=2"))
    page.locator("#time").fill("29")
    page.locator("#play").click()
    until(page, 31)
    page.get_by_role("button", name="Share this moment").click()
    expect(page.locator("#said")).to_contain_text("link to this moment")
    expect(page.locator("#play")).to_have_attribute("aria-label", "Play")  # it waits
    shared = float(re.search(r"#t=([\d.]+)", page.url)[1])
    assert shared > 30.0
    page.locator("#curve").click(position={"x": 0, "y": 5})
    expect(page.locator("#now")).to_have_text("00:01")
    strange = ready(visit(f"{single.resolve().as_uri()}#t=much&zoom=-1&follow=%3Cb%3E&x=1e99"))
    expect(strange.locator("#now")).to_have_text("00:30")


def test_two_controllers_play_locked_in_time(visit: Visit, pair: Path) -> None:
    page = ready(visit(pair))
    expect(page.locator("h2").first).to_contain_text("virtual-signal")
    expect(page.locator("h2").nth(1)).to_contain_text("traffic-light")
    page.locator("#time").fill("99")
    waits = page.locator("[data-figure=average]")
    expect(waits).to_have_count(2)
    expect(waits.nth(0)).not_to_have_text(waits.nth(1).inner_text())
    expect(page.locator("#said")).to_contain_text("virtual-signal at 01:40")
    expect(page.locator("#said")).to_contain_text("traffic-light at 01:40")


def test_layers_can_be_left_out(visit: Visit, single: Path) -> None:
    page = ready(visit(single))
    page.locator("#time").fill("40")
    pictures = [picture(page)]
    for layer in ("decisions", "zones", "lanes without RV"):
        page.get_by_label(layer).uncheck()
        pictures.append(changed(page, pictures[-1]))
    assert len(set(pictures)) == 4


@pytest.mark.parametrize(
    ("phone", "dark"),
    [
        *((True, True), (False, False)),
        *(pytest.param(*look, marks=pytest.mark.slow) for look in ((True, False), (False, True))),
    ],
)
def test_it_is_accessible_and_fits_a_phone(
    visit: Visit, pair: Path, phone: bool, dark: bool
) -> None:
    page = ready(visit(pair, phone=phone, dark=dark))
    page.locator("#time").fill("60")
    assert accessibility_violations(page) == []
    assert not wider_than_its_window(page)


def test_nothing_is_asked_for_but_the_page_itself(visit: Visit, single: Path) -> None:
    ready(visit(single))
    assert [one.partition("#")[0] for one in visit.requests if one.startswith("file")] == [
        single.resolve().as_uri()
    ]


def test_text_is_text_whatever_it_holds(visit: Visit, tmp_path: Path) -> None:
    kept = recorded(ONE)
    record = kept.record.model_copy(update={"controller": EVIL, "scenario": f"a/{EVIL}"})
    names = [f"</script>{EVIL}", *kept.vehicles.id[1:]]
    evil = dataclasses.replace(
        kept, title=EVIL, record=record, vehicles=replace(kept.vehicles, id=names)
    )
    page = ready(visit(Replay([evil]).write(tmp_path / "evil.html")))
    expect(page.locator("h1")).to_have_text(EVIL)
    assert page.title() == f"{EVIL}: {EVIL}"


def test_a_page_is_small(kept: Trajectories) -> None:
    assert len(page.page([kept])) == pytest.approx(94_000, rel=0.1)


@pytest.mark.slow
def test_a_long_episode_of_a_large_intersection_is_as_small_as_docs_say() -> None:
    episode = Episode(catalogue.find_scenario("449"), "time-windows", 0.6, 1)
    size = len(page.page([recorded(episode)])) / 1e6  # MB
    assert size == pytest.approx(0.53, rel=0.1)  # docs/replay.md


def test_records_of_two_kinds_read_alike(kept: Trajectories) -> None:
    assert isinstance(kept.record, Record)
    assert page.shows(page.page([kept])[: page.HEAD]) == [CROSSING.identity]

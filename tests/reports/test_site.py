"""The site as a reader meets it: its pages opened in Chromium from files, without a network."""

from collections.abc import Iterable
from pathlib import Path

import pytest
from browser import DESK, PHONE, Visit, accessibility_violations
from factories.records import record, unlucky
from factories.scenarios import parsed, smoke
from playwright.sync_api import Page, expect

from benchmark.pictures.sheet import whole
from benchmark.records.record import Record
from benchmark.reports.site.build import build_site
from benchmark.reports.site.contents import Contents
from benchmark.scenario.scenario import Scenario

SIGNAL = "traffic-light"
EVIL = "<script>document.title = 'caught'</script>"
EVIL_FILE = f"evil.py:{EVIL}"
RATES = (0.4, 0.6)
WAITS = {"first-come": 12.0, "virtual-signal": 25.0, "wang?training=1": 9.0, EVIL_FILE: 40.0}


def hostile() -> Scenario:
    """A scenario whose every text is markup."""
    scenario = parsed({"title": EVIL, "sources": [EVIL, "Counts & signal: 100 % ours"]})
    return scenario.model_copy(update={"tags": (EVIL,)})


def study(scenario: Scenario) -> Iterable[Record]:
    """Eight seeds of everything at two rates: ok, flagged, failed and skipped."""
    where = {"scenario": scenario.name, "scenario_hash": scenario.hash}
    for seed in range(1, 9):
        yield record(SIGNAL, seed, 20.0 + seed / 8, rate=None, **where)
        for rate in RATES:
            for name, waiting in WAITS.items():
                crashes = 3 if name == "first-come" else 0
                value = waiting + (seed % 3) * rate
                yield record(name, seed, value, rate, collisions=crashes, **where)
            yield unlucky("broken", seed, rate=rate, reason=f"act raised {EVIL}", **where)
            yield unlucky("picky", seed, "skipped", rate=rate, reason="four approaches", **where)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    scenarios = [smoke("crossing"), hostile()]
    contents = Contents.of(
        [one for scenario in scenarios for one in study(scenario)],
        {scenario.hash: scenario for scenario in scenarios},
        {scenarios[0].hash: whole.panels(scenarios[0])},
    )
    build_site(contents, folder / "site")
    return folder / "site"


CROSSING, PAIR = "scenarios/smoke-crossing.html", "pairs/first-come--virtual-signal.html"
KINDS = ["index.html", CROSSING, "controllers/virtual-signal.html", "pairs.html", PAIR]
KINDS += ["methods.html", "scenarios/test-a.html", "controllers/broken.html"]


def names(page: Page) -> list[str]:
    """The controllers that the leaderboard shows, from above."""
    return page.locator("table.board tbody tr:visible th").all_inner_texts()


def drawn(page: Page) -> int:
    """Wait for the chart; how many lines it has besides its zero."""
    page.wait_for_selector(".canvas svg")
    return page.locator(".canvas .mark-line path").count()


FITS = "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
LOOKS = {"light": DESK, "dark": PHONE}


@pytest.mark.parametrize(
    ("name", "theme"),
    [
        pytest.param(name, theme, marks=[pytest.mark.slow] if (row + column) % 2 else [])
        for row, name in enumerate(KINDS)
        for column, theme in enumerate(LOOKS)
    ],
)
def test_every_page_is_accessible_in_both_themes_and_on_a_phone(
    visit: Visit, site: Path, name: str, theme: str
) -> None:
    page = visit(site / name, within=site, viewport=LOOKS[theme], color_scheme=theme)
    if page.locator("figure.chart").count():
        drawn(page)
    assert accessibility_violations(page) == []
    for size in LOOKS.values():
        page.set_viewport_size(size)  # type: ignore[arg-type]
        page.wait_for_function(FITS)


def test_markup_in_records_and_scenario_files_shows_as_text(visit: Visit, site: Path) -> None:
    page = visit(site / "scenarios/test-a.html", within=site)
    assert page.locator("h1").inner_text() == EVIL
    assert page.title() == f"{EVIL} · Right of Way"
    for place in ("#sources + ul", "dl.facts", "fieldset", "table.matrix"):
        assert EVIL in page.locator(place).inner_text()
    page = visit(site / "index.html", within=site)
    page.select_option("select[name=scenario]", "")
    assert EVIL_FILE in names(page)
    assert f"8 failed (act raised {EVIL})" in page.locator("table.board").inner_text()
    assert "caught" not in page.title()


def test_the_theme_follows_the_system_until_the_reader_chooses(visit: Visit, site: Path) -> None:
    def ground(page: Page) -> str:
        return str(page.evaluate("getComputedStyle(document.body).backgroundColor"))

    light, dark = (visit(site / "index.html", within=site, dark=one) for one in (False, True))
    assert ground(light) != ground(dark)
    button = light.get_by_role("button", name="Dark theme")
    assert button.get_attribute("aria-pressed") == "false"
    button.click()
    assert button.get_attribute("aria-pressed") == "true"
    assert ground(light) == ground(dark)
    light.get_by_role("link", name="Methods").first.click()
    light.wait_for_url("**/methods.html")
    assert ground(light) == ground(dark)


def test_the_leaderboard_opens_with_one_scenario_and_rate_least_waiting_first_and_sorts_by_any(
    visit: Visit, site: Path
) -> None:
    page = visit(site / "index.html", within=site)
    assert names(page) == ["first-come", SIGNAL, "virtual-signal", EVIL_FILE, "broken", "picky"]
    assert "6 of 28 rows" in page.locator("output").inner_text()
    bars = page.locator("table.board tbody tr:visible svg.interval")
    places = [float(one.locator("circle").get_attribute("cx") or 0) for one in bars.all()]
    assert len(places) == 4
    assert places == sorted(places)  # as waiting, to one scale
    assert bars.first.locator("path.signal").count() == 1
    head = page.get_by_role("columnheader", name="Waiting")
    assert head.get_attribute("aria-sort") == "ascending"
    head.get_by_role("button").click()
    assert head.get_attribute("aria-sort") == "descending"
    assert names(page)[:2] == [EVIL_FILE, "virtual-signal"]
    assert set(names(page)[-2:]) == {"broken", "picky"}  # without figures, last either way
    page.get_by_role("columnheader", name="Controller").get_by_role("button").click()
    assert names(page) == sorted(names(page))
    assert head.get_attribute("aria-sort") is None


def test_the_leaderboard_filters_and_its_address_can_be_shared(visit: Visit, site: Path) -> None:
    page = visit(site / "index.html", within=site)
    page.select_option("select[name=status]", "flagged")
    assert names(page) == ["first-come"]
    assert "crashes" in page.locator("table.board tbody tr:visible").inner_text()
    page.select_option("select[name=rate]", "")
    assert names(page) == ["first-come"] * 2
    page.select_option("select[name=status]", "")
    page.get_by_label("Controller").fill("SIGNAL")
    assert set(names(page)) == {"virtual-signal"}
    page.get_by_role("columnheader", name="RVs").get_by_role("button").click()
    again = visit(page.url, within=site)
    assert names(again) == names(page)
    assert again.get_by_role("columnheader", name="RVs").get_attribute("aria-sort") == "ascending"
    page.evaluate("location.hash = '#status=flagged'")  # a link within the page, or by hand
    assert names(page) == ["first-come"]
    page.get_by_label("Controller").fill("nobody")
    expect(page.get_by_text("No row fits these filters.")).to_be_visible()


def test_variants_are_shown_on_request(visit: Visit, site: Path) -> None:
    page = visit(site / "index.html", within=site)
    assert "wang?training=1" not in names(page)
    page.get_by_label("Controller").fill("wang?training=1")  # as the list beside it offers
    assert names(page) == ["wang?training=1"]
    page.get_by_label("Controller").fill("")
    page.get_by_label("with 1 variants").check()
    assert names(page)[0] == "wang?training=1"


def test_an_address_of_another_site_falls_back_to_what_there_is(visit: Visit, site: Path) -> None:
    address = f"{(site / 'index.html').as_uri()}#scenario=none&rate=0.9&sort=99"
    assert len(names(visit(address, within=site))) == 6


def test_without_scripts_the_leaderboard_shows_every_row(visit: Visit, site: Path) -> None:
    page = visit(site / "index.html", within=site, java_script_enabled=False)
    assert len(names(page)) == 28


def test_the_keyboard_alone_reaches_and_works_everything(visit: Visit, site: Path) -> None:
    page = visit(site / "index.html", within=site)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "main"
    page.get_by_role("columnheader", name="Waiting").get_by_role("button").focus()
    page.keyboard.press("Enter")
    assert names(page)[0] == EVIL_FILE
    page.locator("table.board tbody tr:visible th a").nth(1).focus()
    page.keyboard.press("Enter")
    assert page.locator("h1").inner_text() == "virtual-signal"


def test_a_scenario_opens_from_the_leaderboard_with_all_that_is_known(
    visit: Visit, site: Path
) -> None:
    page = visit(site / "index.html", within=site)
    page.locator("ul.cards a", has_text="smoke/crossing").click()
    assert page.locator("h1").inner_text() == smoke("crossing").title
    pictures = page.locator(".drawings img")
    assert pictures.count() == 2
    assert all(pictures.evaluate_all("all => all.map(one => one.complete && one.naturalWidth)"))
    signal = smoke("crossing").signal
    assert signal is not None
    assert page.locator("svg.phase").count() == len(signal.phases)
    for heading in ("Waiting", "Lanes", "Volumes", "Signal program", "Sources"):
        expect(page.get_by_role("heading", name=heading, exact=True)).to_be_visible()


def test_the_boxes_choose_the_lines_of_a_chart(visit: Visit, site: Path) -> None:
    page = visit(site / CROSSING, within=site)
    before = drawn(page)
    page.get_by_label("first-come", exact=True).uncheck()
    expect(page.locator(".canvas .mark-line path")).to_have_count(before - 1)
    page.get_by_label("logarithmic").check()
    expect(page.locator(".canvas .mark-line path")).to_have_count(before - 1)


def test_a_star_leads_to_the_reason(visit: Visit, site: Path) -> None:
    page = visit(site / CROSSING, within=site)
    reasons = page.locator("#remarks")
    assert not reasons.is_visible()
    page.locator("a.star").first.click()
    expect(reasons).to_be_visible()
    assert "first-come, 40 %: flagged crashes" in " ".join(reasons.inner_text().split())


def test_a_point_of_a_chart_says_its_figures(visit: Visit, site: Path) -> None:
    page = visit(site / CROSSING, within=site)
    drawn(page)
    page.locator(".canvas .mark-symbol path").first.hover()
    tip = page.locator("#vg-tooltip-element")
    expect(tip).to_be_visible()
    assert "mean [95 %]" in tip.inner_text()


def test_a_pair_shows_who_waits_less_and_by_how_much(visit: Visit, site: Path) -> None:
    page = visit(site / "pairs.html", within=site)
    page.get_by_label("first-come and virtual-signal: less in 4, more in 0").click()
    assert page.url.endswith(PAIR)
    assert drawn(page) == 2
    row = page.locator("main tbody tr").first
    assert "\N{MINUS SIGN}13.0" in row.inner_text()
    assert row.locator("td").last.inner_text() == "first-come"


def test_a_controller_has_its_description_every_scenario_and_the_others(
    visit: Visit, site: Path
) -> None:
    page = visit(site / "controllers/virtual-signal.html", within=site)
    assert "RVs act as a signal" in page.locator(".said").inner_text()
    assert page.locator("table.matrix tbody tr").count() == 2
    page.get_by_role("link", name="first-come").click()
    assert page.url.endswith(PAIR)
    unknown = visit(site / "controllers/broken.html", within=site)
    expect(unknown.get_by_text("No description")).to_be_visible()


def test_the_methods_state_formulas_versions_and_hashes(visit: Visit, site: Path) -> None:
    page = visit(site / "methods.html", within=site)
    assert (
        page.locator("table.formulas math").count() == page.locator("table.formulas tr").count() - 1
    )
    text = page.locator("main").inner_text()
    assert "1.28.0" in text
    assert smoke("crossing").hash[:12] in text

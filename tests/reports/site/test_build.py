"""From records to the folder of pages: what is in it, what is refused, and the smallest stores."""

import csv
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest
from factories.records import junction, record, runs, unlucky
from factories.scenarios import smoke

from benchmark.plumbing.errors import UsageError
from benchmark.records.leaderboard import REFERENCE
from benchmark.records.record import Record
from benchmark.reports.site.build import MARK, build_site
from benchmark.reports.site.contents import Contents
from benchmark.reports.site.replays import ReplayPage

EVIL = "<img src=x onerror=alert(1)>"


class Reader(HTMLParser):
    """A page's links, ids and scripts."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.ids: set[str] = set()
        self.tags: list[str] = []
        self.feed(page.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        self.links += [given[key] or "" for key in ("href", "src") if key in given]
        if "id" in given:
            self.ids.add(given["id"] or "")


def made(records: list[Record], folder: Path, **more: object) -> Path:
    build_site(Contents.of(records, **more), folder / "site")  # type: ignore[arg-type]
    return folder / "site"


def test_every_link_of_every_page_leads_somewhere(tmp_path: Path) -> None:
    replay = tmp_path / "one.html"
    replay.write_text("<title>a</title>")
    scenario = smoke("crossing")
    where = {"scenario": scenario.name, "scenario_hash": scenario.hash}
    records = [record(name, rate=0.5, **where) for name in ("a", "b?x=1", "hierarchical")]
    shown = ReplayPage(replay, "a", (scenario.name,), ("a",))
    site = made(
        [*records, unlucky("broken", reason=EVIL), record(REFERENCE, rate=None)],
        tmp_path,
        files={scenario.hash: scenario},
        drawings={scenario.hash: {"plan": "<svg/>", "counts": "<svg/>"}},
        replays=[shown],
    )
    pages = {path: Reader(path) for path in site.rglob("*.html") if path.parent.name != "replays"}
    assert len(pages) == 3 + 2 + 5 + 10
    for path, page in pages.items():
        for link in page.links:
            address, _, fragment = link.partition("#")
            assert not address.startswith(("http", "/")), link
            target = (path.parent / address).resolve() if address else path
            assert target.is_file(), f"{path}: {link}"
            if fragment:
                assert fragment in pages[target].ids, f"{path}: {link}"
        assert "img" not in page.tags or "drawings" in path.read_text("utf-8")  # none from records
    replayed = [
        path.name for path, page in pages.items() if "replays/one.html" in "".join(page.links)
    ]
    assert sorted(replayed) == ["a.html", "index.html", "smoke-crossing.html"]


def test_the_same_records_give_the_same_bytes(tmp_path: Path) -> None:
    records = [*runs([1, 2, 3], controller="a"), *runs([4, 5, 6], controller=REFERENCE, rate=None)]
    first, second = (made(records, tmp_path / name) for name in ("one", "two"))
    held = [
        {p.relative_to(s): p.read_bytes() for p in s.rglob("*") if p.is_file()}
        for s in (first, second)
    ]
    assert held[0] == held[1]


def test_a_site_is_replaced_whole(tmp_path: Path) -> None:
    site = made(runs([1], controller="old"), tmp_path)
    made(runs([1], controller="new"), tmp_path)
    assert [path.stem for path in (site / "controllers").iterdir()] == ["new"]
    assert [path.name for path in tmp_path.iterdir()] == ["site"]  # nothing is left beside it


def test_a_folder_with_anything_else_is_left_alone(tmp_path: Path) -> None:
    precious = tmp_path / "site" / "thesis.tex"
    precious.parent.mkdir()
    precious.write_text("years")
    with pytest.raises(UsageError, match=r"site: holds thesis.tex .* another folder with --output"):
        made(runs([1], controller="a"), tmp_path)
    assert precious.read_text() == "years"
    shutil.rmtree(precious.parent)
    (tmp_path / "site").write_text("a file")
    with pytest.raises(UsageError, match=r"site: is a file"):
        made(runs([1], controller="a"), tmp_path)


def test_a_site_that_cannot_be_made_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = made(runs([1], controller="old"), tmp_path)

    def full(self: Path, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(UsageError, match="cannot write the site: No space left"):
        made(runs([1], controller="new"), tmp_path)
    assert [path.stem for path in (site / "controllers").iterdir()] == ["old"]
    assert [path.name for path in tmp_path.iterdir()] == ["site"]


def test_without_records_the_pages_say_so(tmp_path: Path) -> None:
    site = made([], tmp_path)
    assert sorted(path.name for path in site.rglob("*.html")) == [
        *("index.html", "methods.html", "pairs.html")
    ]
    assert "No records yet" in (site / "index.html").read_text("utf-8")
    assert "no two controllers" in (site / "pairs.html").read_text("utf-8")
    assert (site / MARK).is_file()


def test_a_single_record_has_figures_without_intervals(tmp_path: Path) -> None:
    site = made([record("a", waiting=7.25)], tmp_path)
    text = (site / "index.html").read_text("utf-8")
    assert "1 controller, 1 scenario, 1 episode;" in text
    assert '<span class="mean">7.2</span></td>' in text
    assert "not at hand" in (site / "scenarios" / "test-a.html").read_text("utf-8")


@pytest.mark.parametrize("status", ["failed", "skipped", "crashed", "timed out"])
def test_a_store_without_a_single_good_episode_shows_why(tmp_path: Path, status: str) -> None:
    site = made([unlucky("a", seed, status, reason=EVIL) for seed in (1, 2)], tmp_path)
    page = site / "scenarios" / "test-a.html"
    text = page.read_text("utf-8")
    assert f"2 {status} (&lt;img src=x onerror=alert(1)&gt;)" in text
    assert "No chart" in text
    assert "img" not in Reader(page).tags


def test_signals_alone_have_no_rate(tmp_path: Path) -> None:
    site = made(runs([4, 5, 6], controller=REFERENCE, rate=None), tmp_path)
    assert "no RVs" in (site / "scenarios" / "test-a.html").read_text("utf-8")


def test_rates_may_differ_between_scenarios(tmp_path: Path) -> None:
    calm = runs([3, 4], controller=REFERENCE, rate=None)  # no rate was run there
    other = {"scenario": "test/b", "scenario_hash": "b" * 64}
    busy = [record(name, rate=rate, **other) for name, rate in ((REFERENCE, None), ("c", 0.3))]
    site = made(
        [*calm, *busy, record("c", rate=0.9, scenario="z/z", scenario_hash="c" * 64)], tmp_path
    )
    text = (site / "controllers" / "traffic-light.html").read_text("utf-8")
    assert text.index("no RVs</th>") < text.index("30 %</th>")
    assert "90 %</th>" not in text
    board = (site / "index.html").read_text("utf-8")
    assert '<option value="none" selected>no RVs</option>' in board
    shown = [line for line in board.splitlines() if "<tr data-" in line and " hidden" not in line]
    assert len(shown) == 1  # something fits the filters that the page opens with


def test_several_versions_and_junctions_of_a_scenario_have_pages_of_their_own(
    tmp_path: Path,
) -> None:
    both = {"north": junction(10.0), "south": junction(20.0)}
    records = [record("a", junctions=both), record("a", scenario_hash="b" * 64)]
    site = made(records, tmp_path)
    assert {path.name for path in (site / "scenarios").iterdir()} == {
        *(f"test-a-aaaaaaaa-{place}.html" for place in ("network", "north", "south")),
        "test-a-bbbbbbbb.html",
    }


def test_the_download_holds_the_rows_of_its_scenario(tmp_path: Path) -> None:
    records = [
        *runs([1, 2, 3], controller="a"),
        record("a", scenario="test/b", scenario_hash="b" * 64),
    ]
    site = made(records, tmp_path)
    with (site / "data" / "test-a.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert (row["scenario"], float(row["average_waiting_time"])) == ("test/a", 2.0)
    with (site / "data" / "leaderboard.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 2

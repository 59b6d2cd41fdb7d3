"""From records to the folder of pages: what is in it, what is refused, and the smallest stores."""

import csv
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest
from factories.records import junction, record, unlucky
from factories.scenarios import smoke
from hypothesis import given
from hypothesis import strategies as st

from benchmark.plumbing.errors import UsageError
from benchmark.records.formulas import FORMULAS
from benchmark.records.leaderboard import REFERENCE
from benchmark.records.measures import COLUMNS
from benchmark.records.record import Record
from benchmark.records.statistics import estimates
from benchmark.reports.site import charts, intervals, methods, pairs
from benchmark.reports.site.addresses import slugs
from benchmark.reports.site.build import MARK, build
from benchmark.reports.site.contents import MOST_PAIRS, Contents
from benchmark.reports.site.replays import Replay

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
    build(Contents.of(records, **more), folder / "site")  # type: ignore[arg-type]
    return folder / "site"


def some(controller: str, waits: list[float], rate: float | None = 0.5) -> list[Record]:
    return [record(controller, seed, wait, rate) for seed, wait in enumerate(waits, start=1)]


# --- the folder --------------------------------------------------------------------------------


def test_every_link_of_every_page_leads_somewhere(tmp_path: Path) -> None:
    replay = tmp_path / "one.html"
    replay.write_text("<title>a</title>")
    scenario = smoke("crossing")
    where = {"scenario": scenario.name, "scenario_hash": scenario.hash}
    records = [record(name, rate=0.5, **where) for name in ("a", "b?x=1", "hierarchical")]
    shown = Replay(replay, "a", (scenario.name,), ("a",))
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
    records = [*some("a", [1, 2, 3]), *some(REFERENCE, [4, 5, 6], None)]
    first, second = (made(records, tmp_path / name) for name in ("one", "two"))
    held = [
        {p.relative_to(s): p.read_bytes() for p in s.rglob("*") if p.is_file()}
        for s in (first, second)
    ]
    assert held[0] == held[1]


def test_a_site_is_replaced_whole(tmp_path: Path) -> None:
    site = made(some("old", [1]), tmp_path)
    made(some("new", [1]), tmp_path)
    assert [path.stem for path in (site / "controllers").iterdir()] == ["new"]
    assert [path.name for path in tmp_path.iterdir()] == ["site"]  # nothing is left beside it


def test_a_folder_with_anything_else_is_left_alone(tmp_path: Path) -> None:
    precious = tmp_path / "site" / "thesis.tex"
    precious.parent.mkdir()
    precious.write_text("years")
    with pytest.raises(UsageError, match=r"site: holds thesis.tex .* another folder with --output"):
        made(some("a", [1]), tmp_path)
    assert precious.read_text() == "years"
    shutil.rmtree(precious.parent)
    (tmp_path / "site").write_text("a file")
    with pytest.raises(UsageError, match=r"site: is a file"):
        made(some("a", [1]), tmp_path)


def test_a_site_that_cannot_be_made_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = made(some("old", [1]), tmp_path)

    def full(self: Path, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(UsageError, match="cannot write the site: No space left"):
        made(some("new", [1]), tmp_path)
    assert [path.stem for path in (site / "controllers").iterdir()] == ["old"]
    assert [path.name for path in tmp_path.iterdir()] == ["site"]


# --- small and odd stores ----------------------------------------------------------------------


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
    site = made(some(REFERENCE, [4, 5, 6], None), tmp_path)
    assert "no RVs" in (site / "scenarios" / "test-a.html").read_text("utf-8")


def test_rates_may_differ_between_scenarios(tmp_path: Path) -> None:
    calm = some(REFERENCE, [3, 4], None)  # no rate was run there
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
    assert len(list((site / "scenarios").iterdir())) == 3


def test_the_download_holds_the_rows_of_its_scenario(tmp_path: Path) -> None:
    records = [*some("a", [1, 2, 3]), record("a", scenario="test/b", scenario_hash="b" * 64)]
    site = made(records, tmp_path)
    with (site / "data" / "test-a.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert (row["scenario"], float(row["average_waiting_time"])) == ("test/a", 2.0)
    with (site / "data" / "leaderboard.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 2


# --- names -------------------------------------------------------------------------------------


@given(st.sets(st.text(max_size=100), max_size=8))
def test_file_names_are_plain_and_differ_whatever_the_names(names: set[str]) -> None:
    found = slugs(names)
    assert found.keys() == names
    lower = [slug.lower() for slug in found.values()]
    assert len(set(lower)) == len(lower)
    for slug in found.values():
        assert 0 < len(slug.encode()) <= 100
        assert set(slug) <= set("abcdefghijklmnopqrstuvwxyz0123456789._-")
        assert not slug.startswith(".")


def test_file_names_follow_the_names() -> None:
    found = slugs(["colorado-springs/229", "virtual-signal?green=15", "A", "a", "../../etc/passwd"])
    assert found["colorado-springs/229"] == "colorado-springs-229"
    assert found["virtual-signal?green=15"] == "virtual-signal-green-15"
    assert found["../../etc/passwd"] == "etc-passwd"
    assert found["A"].startswith("a-")


# --- figures -----------------------------------------------------------------------------------


def test_differences_are_paired_by_seed() -> None:
    ours, theirs = [1.0, 5.0, 2.0, 4.0, 3.0, 1.5], [2.0, 5.5, 4.0, 5.0, 3.5, 2.5]
    contents = Contents.of([*some("a", ours), *some("b", [*theirs, 99.0])])  # the seventh is alone
    (one,) = pairs.compare(contents, "a", "b")
    assert one.headline == estimates([[a - b for a, b in zip(ours, theirs, strict=True)]])[0]
    assert one.means == (pytest.approx(2.75), pytest.approx(3.75))
    (back,) = pairs.compare(contents, "b", "a")
    assert back.headline.mean == -one.headline.mean
    assert pairs.tally([one]) == pairs.Tally(1, 0, 0)
    assert pairs.tally([back]) == pairs.Tally(0, 1, 0)


def test_few_seeds_decide_nothing() -> None:
    found = pairs.compare(Contents.of([*some("a", [1, 2]), *some("b", [8, 9])]), "a", "b")
    assert pairs.tally(found) == pairs.Tally(0, 0, 1)


def test_who_shares_no_seed_is_not_compared() -> None:
    assert pairs.compare(Contents.of([record("a", 1), record("b", 2)]), "a", "b") == []


def test_controllers_stand_in_the_order_of_whom_they_wait_less_than() -> None:
    everywhere = [
        record(name, rate=rate, waiting=wait * factor)
        for rate, factor in ((0.1, 20), (0.9, 1))
        for name, wait in (("good", 1), ("middling", 2), ("bad", 3))
    ]
    lucky = record("easy-only", rate=0.9, waiting=2.5)  # not run where everybody waits long
    contents = Contents.of([*everywhere, lucky, record("good?x=1", rate=0.1, waiting=0.1)])
    assert contents.controllers == ["good", "middling", "easy-only", "bad", "good?x=1"]
    assert contents.variants == ["good?x=1"]


def test_with_many_controllers_the_best_and_the_signal_have_pairs() -> None:
    names = [f"c{index:02}" for index in range(40)]
    records = [record(name, waiting=1.0 + index) for index, name in enumerate(names)]
    contents = Contents.of([*records, record(REFERENCE, rate=None, waiting=99.0)])
    found = set(contents.pairs)
    assert ("c00", "c01") in found
    assert ("c38", "c39") not in found
    assert all((name, REFERENCE) in found for name in names)
    assert len(found) <= MOST_PAIRS + len(names)


@given(st.lists(st.floats(0, 1e5), min_size=2, max_size=9, unique=True))
def test_bars_stay_on_their_rail_and_in_order(waits: list[float]) -> None:
    rows = Contents.of([record(f"c{i}", waiting=wait) for i, wait in enumerate(waits)]).rows
    scale = intervals.Scale.of(rows)
    places = [scale.place(wait) for wait in sorted(waits)]
    assert places == sorted(places)
    assert places[0] >= 0
    assert places[-1] <= intervals.WIDTH


def test_every_column_of_the_leaderboard_has_a_formula() -> None:
    assert FORMULAS.keys() == {column.key for column in COLUMNS}
    assert all(metric.formula.startswith("<math") for metric in methods.metrics())


def test_the_hash_of_records_depends_on_neither_order_nor_wall_time() -> None:
    one, other = record("a", 1), record("a", 2)
    slower = other.model_copy(update={"wall_time": 9.0})
    assert methods.records_hash([one, other]) == methods.records_hash([slower, one])
    assert methods.records_hash([one]) != methods.records_hash([one, other])


def test_lines_of_a_chart_look_different() -> None:
    looks = charts.lines([*(f"c{index}" for index in range(40)), REFERENCE])
    assert len({(line.colour, line.dash) for line in looks}) == 41
    assert [line.name for line in looks if line.shown] == [REFERENCE, *(f"c{i}" for i in range(6))]

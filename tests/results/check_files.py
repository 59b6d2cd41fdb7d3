"""What is committed is whole, and follows from the records."""

import shutil
from pathlib import Path

import pytest
from factories.committed import FOUR, RATES, RESULTS, by_seed, differences, waiting
from factories.scenarios import ROOT
from polars.testing import assert_frame_equal

from baselines.paper import missing, report
from baselines.paper.samples import Samples
from benchmark.control import plugins
from benchmark.records import leaderboard, provenance, reference
from benchmark.records.capacity import capacity_curves, capacity_markdown
from benchmark.records.record import Record
from benchmark.records.statistics import ENOUGH
from benchmark.records.store import Store
from benchmark.reports import tables
from benchmark.reports.plots import gallery
from benchmark.reports.plots.data import Data, Wish
from benchmark.scenario import catalogue
from benchmark.study.episodes import episodes_of
from benchmark.study.suite import load_suite, shipped_suites

SHOWN = ("wang", "wang-tuned", "hierarchical", "hierarchical-tuned", "time-windows")
REMEDY = "regenerate with `make reference`"


def test_every_shipped_controller_has_all_its_seeds_in_every_cell(records: list[Record]) -> None:
    held = {(r.scenario, r.controller, r.rate, r.seed) for r in records if r.status == "ok"}
    wanted = {
        (f"colorado-springs/{scenario}", name, rate, seed)
        for scenario in FOUR
        for name, entry in plugins.discovered().items()
        if entry.value.startswith("baselines.")
        for rate in (RATES if plugins.load_class(name).needs_robot_vehicles else [None])
        for seed in range(1, 21)
    }
    assert wanted <= held


def test_the_records_are_of_the_scenarios_as_they_are(records: list[Record]) -> None:
    hashes = {one.name: one.hash for one in catalogue.find_scenarios(["colorado-springs"])}
    assert {(r.scenario, r.scenario_hash) for r in records} == set(hashes.items())


@pytest.mark.parametrize(("folder", "target"), [("", "results"), ("time-windows", "ablations")])
def test_the_leaderboard_files_follow_from_the_records(folder: str, target: str) -> None:
    remedy = f"regenerate with `make {target}`"
    results = RESULTS / folder
    rows = leaderboard.rows_of_records(Store(results).read())
    assert (results / "LEADERBOARD.md").read_text("utf-8") == tables.leaderboard_markdown(rows), (
        remedy
    )
    assert (results / "leaderboard.csv").read_text("utf-8") == tables.leaderboard_csv(rows), remedy


def test_the_readme_shows_the_table_of_the_results(rows: list[leaderboard.Row]) -> None:
    shown = tables.table_at_rate([row for row in rows if "?" not in row.controller], 0.6)
    assert shown in (ROOT / "README.md").read_text("utf-8"), (
        "paste the output of `rightofway leaderboard --records results --rate 0.6 --no-variants`"
    )


def test_the_ablations_of_time_windows_start_from_the_rows_of_the_leaderboard(
    records: list[Record],
) -> None:
    held = Store(RESULTS / "time-windows").read()
    for scenario in FOUR:
        for rate in (0.4, 0.6):
            ablated, shown = (by_seed(of, scenario, "time-windows", rate) for of in (held, records))
            assert len(ablated) == 20
            assert not any(differences(ablated, shown, waiting))
            variants = {r.controller for r in held if r.rate == rate} - {"time-windows"}
            assert len(variants) == 4
            assert all(len(by_seed(held, scenario, one, rate)) == 20 for one in variants)


PICTURES = (report.WAITING, report.UNREGULATED)


def test_the_papers_report_follows_from_the_records(samples: Samples) -> None:
    written = (RESULTS / "paper" / "PAPER.md").read_text("utf-8")
    suite = load_suite(missing.SUITE)
    assert not missing.gaps(samples, suite)
    again = report.report(samples, suite, Path("results"), PICTURES, "")
    assert written.startswith(again.rstrip()), "regenerate with `rightofway paper`"


def test_the_committed_curves_say_what_the_results_say() -> None:
    folder = RESULTS / "capacity"
    found = capacity_markdown(capacity_curves(Store(folder).table()))
    assert (folder / "CAPACITY.md").read_text("utf-8") == found, "regenerate with `make capacity`"


def test_the_committed_page_has_all_its_figures() -> None:
    folder = RESULTS / "figures"
    page = (folder / gallery.PAGE).read_text()
    for name in gallery.NAMES:
        assert f"]({name}.png)" in page
        assert (folder / f"{name}.png").is_file()


def test_the_committed_crossovers_are_those_of_the_records(tmp_path: Path) -> None:
    """The figure of least bytes stands for all: drawn again, it is the same."""
    store = Store(RESULTS)
    shown = Data(store.table(), store.records_of, Wish(controllers=SHOWN))
    ((_, path),) = gallery.write_figures(shown, {}, tmp_path, "png", ["crossover"])
    assert path is not None
    committed = RESULTS / "figures" / "crossover.png"
    assert path.read_bytes() == committed.read_bytes(), "draw again with `make figures`"


def test_the_committed_records_come_back_and_take_less_room(tmp_path: Path) -> None:
    (tmp_path / "records").mkdir()
    shutil.copy(RESULTS / "records" / "colorado-springs-334.jsonl", tmp_path / "records")
    store = Store(tmp_path)
    before, size, table = store.read(), store.size(), store.table()
    with store.writing():
        store.compact()
    assert store.read() == before
    assert_frame_equal(store.table(), table)
    assert store.size() < size / 3


def test_ours_holds_every_episode_of_its_suite(shipped: reference.RegressionReference) -> None:
    suite = load_suite(shipped_suites()["regression"])
    assert shipped.provenance is not None
    assert shipped.provenance.suite_hash == provenance.hash_of(suite), REMEDY
    assert (suite.seeds or 0) >= ENOUGH  # or nothing could be proven
    wanted = episodes_of(suite)
    assert {one.episode for one in shipped.records} == {
        (one.scenario.name, one.scenario.hash, one.controller, one.rate, one.seed) for one in wanted
    }, REMEDY
    assert {one.status for one in shipped.records} == {"ok"}


def test_ours_names_nobodys_machine(shipped: reference.RegressionReference) -> None:
    made = shipped.provenance
    assert made is not None
    assert made.command.startswith("rightofway reference update")
    assert "/tmp" not in made.command
    assert made.git is not None

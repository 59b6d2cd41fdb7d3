"""From records to the paper's table and figures: known reductions, honest marks, named gaps."""

import re
import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from factories.command_line import rightofway
from factories.records import record, unlucky
from matplotlib.image import imread

from baselines.paper import figures, missing, published, report, tables, worth
from baselines.paper.reductions import against, summary, summary_of_paper
from baselines.paper.samples import Samples, canonical
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.reports.plots import style
from benchmark.study.suite import load_suite

SUITE = load_suite(missing.SUITE)
SEEDS = range(1, 21)
BASE = {seed: 20.0 + 5 * ((7 * seed) % 11) for seed in SEEDS}  # s, of the baselines
CURVE = (1.0, 0.6, 0.4)
WANG, SIGNAL = published.WANG, published.SIGNAL
NAMES = (report.WAITING, report.UNREGULATED)


def at(
    controller: str,
    where: str = "229",
    rate: float | None = 0.4,
    seeds: Iterable[int] = SEEDS,
    share: float = 1.0,
    **facts: Any,
) -> list[Record]:
    """Episodes in which vehicles wait a share of the baselines' times."""
    settled = {"scenario": f"colorado-springs/{where}", "rate": rate, **facts}
    settled.setdefault("unregulated_lane_curve", CURVE)
    return [record(controller, seed, share * BASE[seed], **settled) for seed in seeds]


def everywhere(controller: str, share: float = 1.0) -> list[Record]:
    return [
        one for where, rate in published.cells() for one in at(controller, where, rate, share=share)
    ]


@pytest.fixture(scope="module")
def whole() -> list[Record]:
    """Records of everything but the ablations: a fifth less waiting, tuned half."""
    signal = [one for where in published.INTERSECTIONS for one in at("traffic-light", where, None)]
    methods = [*everywhere("hierarchical", 0.8), *everywhere("hierarchical-tuned", 0.5)]
    return [*signal, *everywhere("wang"), *methods]


def cells_of(text: str, *words: str) -> list[str]:
    """The cells of the first row of a Markdown table that begins with these words."""
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if cells[: len(words)] == list(words):
            return cells
    raise AssertionError(f"no row {words} in\n{text}")


def test_the_papers_table_is_whole_and_its_abstract_is_in_it() -> None:
    for baseline in (published.WANG, published.SIGNAL):
        assert [len(row) for row in published.REDUCTIONS[baseline].values()] == [4] * 4
    assert published.reduction("wang", "334", 0.5) == 54.67  # "up to 54 %"
    assert published.reduction("traffic-light", "229", 0.4) is None


def test_the_papers_means_count_a_star_as_zero() -> None:
    wang, signal = (summary_of_paper(against(Samples([]), one)) for one in (WANG, SIGNAL))
    assert (wang.lower, signal.lower) == (13, 14)
    assert wang.stars_as_zero == pytest.approx(3.7145 / 16)
    assert signal.stars_as_zero == pytest.approx(5.7725 / 16)


def test_options_are_compared_in_the_order_that_records_have() -> None:
    assert canonical("hierarchical?low=forward&lateral=false") == (
        "hierarchical?lateral=false&low=forward"
    )
    assert canonical("wang") == "wang"


def test_the_newest_record_of_an_episode_counts_and_failures_do_not() -> None:
    records = [
        *at("wang", seeds=[1, 2], travel_time=50.0),
        *at("wang", seeds=[1], travel_time=70.0),
        unlucky("wang", 3, scenario="colorado-springs/229", rate=0.4),
        *at("wang", "332", seeds=[4]),
    ]
    found = Samples(records).values("travel_time", "wang", ("229", 0.4))
    assert found == {1: 70.0, 2: 50.0}


def test_of_two_versions_of_a_scenario_the_last_one_counts() -> None:
    records = [*at("wang", seeds=[1, 2], scenario_hash="b" * 64), *at("wang", seeds=[2, 3])]
    assert sorted(Samples(records).seeds("wang", ("229", 0.4))) == [2, 3]


def test_a_signal_stands_at_every_rate() -> None:
    samples = Samples(at("traffic-light", rate=None, seeds=[1]))
    assert all(samples.seeds("traffic-light", ("229", rate)) for rate in published.RATES)


def test_a_known_reduction_is_found_in_every_cell(whole: list[Record]) -> None:
    samples = Samples(whole)
    for baseline in ("wang", "traffic-light"):
        table = against(samples, baseline)
        assert [(one.intersection, one.rate) for one in table] == list(published.cells())
        for one in table:
            plain, tuned = one.ours.values()
            assert plain is not None
            assert tuned is not None
            assert (plain.mean, plain.low, plain.high) == pytest.approx((0.2,) * 3)
            assert tuned.mean == pytest.approx(0.5)
            assert plain.excludes_zero
        found = summary(table, "hierarchical")
        assert (found.cells, found.lower, found.surely_lower, found.surely_higher) == (
            16,
            16,
            16,
            0,
        )
        assert found.stars_as_zero == pytest.approx(0.2) == pytest.approx(found.mean)


def test_only_seeds_that_both_have_are_compared() -> None:
    samples = Samples([*at("wang", seeds=range(1, 11)), *at("hierarchical", seeds=range(5, 21))])
    (first, *_) = against(samples, "wang")
    assert first.ours["hierarchical"] is not None
    assert first.ours["hierarchical"].count == 6
    assert first.ours["hierarchical-tuned"] is None


def test_more_waiting_counts_as_zero_as_in_the_paper_and_as_it_is() -> None:
    ours = [*at("hierarchical", "229", share=3.0), *at("hierarchical", "449", share=0.4)]
    table = against(Samples([*at("wang", "229"), *at("wang", "449"), *ours]), "wang")
    found = summary(table, "hierarchical")
    assert (found.cells, found.lower, found.surely_lower, found.surely_higher) == (2, 1, 1, 1)
    assert found.stars_as_zero == pytest.approx(0.3)
    assert found.mean == pytest.approx((0.6 - 2.0) / 2)


def test_no_records_leave_no_summary() -> None:
    found = summary(against(Samples([]), "wang"), "hierarchical")
    assert (found.cells, found.lower, found.mean, found.stars_as_zero) == (0, 0, None, None)


def test_the_table_shows_the_paper_beside_ours_with_its_marks() -> None:
    noise = [
        record("hierarchical", seed, BASE[1 + (3 * seed) % 20], scenario="colorado-springs/229")
        for seed in SEEDS
    ]
    noise = [one.model_copy(update={"rate": 0.6}) for one in noise]
    worse = at("hierarchical", "229", 0.7, share=1.5)
    base = [one for rate in published.RATES for one in at("wang", "229", rate)]
    sure = at("hierarchical", "229", 0.4, share=0.75)
    table = against(Samples([*base, *sure, *noise, *worse]), "wang")
    text = tables.reduction_table(table)
    assert cells_of(text, "229", "40 %")[2:] == ["18.98", "25.0 [25.0, 25.0]", "-"]
    assert cells_of(text, "229", "50 %")[2:] == ["6.66", "-", "-"]
    assert re.fullmatch(
        r"-?[\d.]+ \[-[\d.]+, [\d.]+\]( \\\*)? n\.s\.", cells_of(text, "229", "60 %")[3]
    )
    assert cells_of(text, "229", "70 %")[2:4] == [r"\*", r"-50.0 [-50.0, -50.0] \*"]
    together = tables.summary_table(table)
    assert cells_of(together, "paper")[1:] == ["23.2", "-", "13 of 16 cells", "-", "-"]
    assert cells_of(together, "`hierarchical`")[3].endswith("of 3 cells")


def test_few_seeds_are_never_sure() -> None:
    few = [*at("wang", seeds=[1, 2, 3]), *at("hierarchical", seeds=[1, 2, 3], share=0.5)]
    text = tables.reduction_table(against(Samples(few), "wang"))
    assert cells_of(text, "229", "40 %")[3] == "50.0 [50.0, 50.0] n.s."


def test_what_is_beside_waiting_has_a_row_for_each_cell_and_controller() -> None:
    facts = {"travel_time": 111.0, "throughput": 3456.0, "collisions_with_robot": 2}
    text = tables.beside_waiting(Samples([*at("wang", **facts), *at("hierarchical", seeds=[1])]))
    deviation = np.std(list(BASE.values()), ddof=1)
    median = np.median(list(BASE.values()))
    assert cells_of(text, "229", "40 %", "`wang`")[4:] == [
        *(f"{median:.1f}", f"{deviation:.1f}", "111.0 [111.0, 111.0]"),
        *("3456 [3456, 3456]", "2.0 [2.0, 2.0]", "20"),
    ]
    assert cells_of(text, "229", "40 %", "`hierarchical`")[5] == "-"
    assert len(text.splitlines()) == 4


def test_ablations_have_a_row_each_at_their_intersection() -> None:
    records = [
        *at("hierarchical", travel_time=90.0),
        *at("hierarchical?zones=false", rate=0.7, travel_time=80.0),
        *at("hierarchical?brand=new", travel_time=70.0),
        *at("hierarchical?top=go", "332"),
        *at("virtual-signal"),
    ]
    text = tables.ablation_table(Samples(records), "229")
    rows = [line.split("|")[1].strip() for line in text.splitlines()[2:]]
    assert rows == ["`hierarchical`", "`hierarchical?zones=false`", "`hierarchical?brand=new`"]
    cells = cells_of(text, "`hierarchical?zones=false`")
    assert cells[1] == "no speed zones"
    assert cells[2:5] == cells[6:9] == ["-", "-", "-"]
    assert cells[9] == "80.0 [80.0, 80.0]"


def test_the_difference_that_a_low_level_makes_is_paired() -> None:
    random = at("hierarchical?low=random", travel_time=100.0)
    ours = [
        record("hierarchical", s, BASE[s] - 5, rate=0.4, scenario="colorado-springs/229")
        for s in SEEDS
    ]
    samples = Samples([*random, *ours])
    waits, travels = (worth.table(samples, k) for k in ("average_waiting_time", "travel_time"))
    assert cells_of(waits, "229", "40 %")[2:] == ["-5.0 [-5.0, -5.0]", *["-"] * 5]
    assert cells_of(travels, "229", "40 %")[2] == "-40.0 [-40.0, -40.0]"
    assert cells_of(waits, "mean")[2] == "-"  # fifteen cells have nothing
    assert len(waits.splitlines()) == 4
    assert worth.table(Samples(ours), "travel_time") == "No records yet."


def test_the_mean_over_cells_is_paired_by_seed() -> None:
    plain = [*everywhere("hierarchical-tuned", 0.5)]
    random = [
        one
        for index, (where, rate) in enumerate(published.cells())
        for one in at("hierarchical-tuned?low=random", where, rate, share=0.5 + 0.1 * (index < 8))
    ]
    text = worth.table(Samples([*plain, *random]), "average_waiting_time")
    mean_base = sum(BASE.values()) / len(BASE)
    assert cells_of(text, "mean")[3].startswith(f"{-0.05 * mean_base:.1f} [")
    assert worth.legend().splitlines()[1] == (
        "- B: `hierarchical-tuned` - `hierarchical-tuned?low=random`"
    )


def gap(records: Iterable[Record], controller: str) -> missing.Gap | None:
    found = missing.gaps(Samples(records), SUITE)
    return next((one for one in found if one.controller == controller), None)


def test_what_is_whole_is_no_gap(whole: list[Record]) -> None:
    lacking = {one.controller for one in missing.gaps(Samples(whole), SUITE)}
    assert lacking.isdisjoint({"wang", "traffic-light", "hierarchical", "hierarchical-tuned"})
    assert "hierarchical?lateral=false&low=forward" in lacking


def test_a_gap_names_cells_seeds_failures_and_the_command(whole: list[Record]) -> None:
    holes = {("449", 0.5): SEEDS, ("449", 0.6): SEEDS, ("332", 0.7): [3, 4]}
    left = [
        one
        for one in whole
        if one.controller != "hierarchical"
        or one.seed not in holes.get((one.scenario.rpartition("/")[2], one.rate or 0), [])
    ]
    left.append(unlucky("hierarchical", 3, "crashed", scenario="colorado-springs/332", rate=0.7))
    found = gap(left, "hierarchical")
    assert found is not None
    assert found.words == (
        "449 at 50 % and 60 % (0 of 20 seeds), 332 at 70 % (18 of 20 seeds); "
        "episodes that are not ok: 1"
    )
    assert found.command(Path("my results")) == (
        "rightofway run 449 332 --controller hierarchical --rate 0.5 --rate 0.6 --rate 0.7 "
        "--seeds 20 --out 'my results'"
    )


def test_a_controller_without_records_is_named_with_a_command_that_survives_a_shell() -> None:
    found = gap([], "hierarchical?lateral=false&low=forward")
    assert found is not None
    assert found.words == "no records"
    parts = shlex.split(found.command(Path("out")))
    assert parts[:3] == ["rightofway", "run", "colorado-springs"]
    assert parts[4] == "hierarchical?lateral=false&low=forward"


def test_the_report_holds_a_table_for_what_is_there_and_says_what_is_not() -> None:
    text = report.report(
        Samples(at("wang")), SUITE, Path("out"), (), report.example("E", drawn=False)
    )
    assert "- `hierarchical-tuned`: no records" in text
    assert "`rightofway run paper --out out`" in text
    assert "![" not in text
    assert cells_of(text, "229", "40 %")[2:] == ["18.98", "-", "-"]
    assert text.endswith("## A lane change that regulates a lane\n\nE\n")


def test_a_whole_report_has_no_section_on_what_is_missing(whole: list[Record]) -> None:
    suite = SUITE.model_copy(update={"controllers": ("wang", "hierarchical")})
    text = report.report(Samples(whole), suite, Path("out"), (), "")
    assert "Missing" not in text
    assert "20.0 [20.0, 20.0]" in text


def test_figures_are_the_same_bytes_again_and_show_every_controller(
    whole: list[Record], tmp_path: Path
) -> None:
    places = tmp_path / "once", tmp_path / "again"
    samples = Samples([record for record in whole if record.seed < 4])
    for place in places:
        place.mkdir()
        names = figures.write(samples, place)
    for name in names:
        once, again = ((place / name).read_bytes() for place in places)
        assert once == again
    image = imread(places[0] / report.UNREGULATED)[..., :3]
    for colour in style.COLOURS[: len(figures.SHOWN)]:
        wanted = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        assert (np.abs(image - wanted).max(axis=2) < 0.02).sum() > 50, colour


def test_only_figures_that_show_something_are_written(tmp_path: Path) -> None:
    assert figures.write(Samples(at("wang", seeds=[1])), tmp_path) == NAMES
    assert figures.write(Samples(at("wang", rate=0.7)), tmp_path) == NAMES[:1]
    assert figures.write(Samples(at("traffic-light", rate=None)), tmp_path) == ()
    assert not [*tmp_path.iterdir()]  # none of an earlier time


def test_the_paper_is_measured_against_the_deployed_signal_alone(whole: list[Record]) -> None:
    others = [*everywhere("traffic-light-actuated"), *everywhere("first-come")]
    waiting = figures.drawn(Samples([*whole, *others]))[report.WAITING]
    assert waiting is not None
    (legend,) = waiting.legends
    assert [text.get_text() for text in legend.get_texts()] == [*figures.SHOWN, SIGNAL]


def test_figures_of_the_paper_are_at_its_rates(whole: list[Record]) -> None:
    others = everywhere("wang", 0.1)
    more = [one.model_copy(update={"rate": 0.1}) for one in others]
    waiting = figures.drawn(Samples([*whole, *more]))[report.WAITING]
    assert waiting is not None
    labels = [tick.get_text() for tick in waiting.axes[-1].get_xticklabels()]
    assert labels == ["40 %", "50 %", "60 %", "70 %"]


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A results folder with few records."""
    store = Store(tmp_path / "results")
    store.prepare()
    for one in [*at("wang"), *at("hierarchical", share=0.8), *at("traffic-light", rate=None)]:
        store.append(one)
    return tmp_path


def test_the_command_writes_tables_and_figures_from_records(results: Path) -> None:
    done = rightofway(results, "paper", "--no-lane-change")
    assert (done.returncode, done.stdout) == (0, "results/paper/PAPER.md\n")
    assert "hierarchical-tuned: no records" in done.stderr
    text = (results / "results/paper/PAPER.md").read_text()
    assert cells_of(text, "229", "40 %")[2:] == ["18.98", "20.0 [20.0, 20.0]", "-"]
    links = re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
    assert sorted(links) == ["unregulated-lanes.png", "waiting.png"]
    for link in links:
        assert (results / "results/paper" / link).read_bytes().startswith(b"\x89PNG")


def test_the_command_shows_a_lane_change(results: Path) -> None:
    options = ("--controller", "time-windows")
    done = rightofway(results, "paper", "--records", "results/records", "--out", "there", *options)
    assert done.returncode == 0, done.stderr
    text = (results / "there/PAPER.md").read_text()
    assert "of colorado-springs/334 at 40 % RVs, seed 1, under `time-windows`" in text
    assert "its controller asked for it" in text
    assert (results / "there/lane-change.png").read_bytes().startswith(b"\x89PNG")


def test_a_controller_that_cannot_be_run_costs_only_the_example(results: Path) -> None:
    done = rightofway(results, "paper", "--controller", "wnag")
    assert done.returncode == 0
    assert "no example of a lane change" in done.stderr
    text = (results / "results/paper/PAPER.md").read_text()
    assert 'No example: unknown controller "wnag"; did you mean "wang"?' in text
    assert not (results / "results/paper/lane-change.png").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--records", "nowhere"], "nowhere/records: no records here"),
        (["--records", "others"], "others: no records of the paper's intersections"),
        (["--no-lane-change", "--out", "file/below"], "choose another folder with --out"),
    ],
)
def test_misuse_ends_in_exit_code_2(results: Path, arguments: list[str], words: str) -> None:
    (results / "file").touch()
    store = Store(results / "others")
    store.prepare()
    store.append(record())
    done = rightofway(results, "paper", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr
    assert "Traceback" not in done.stderr

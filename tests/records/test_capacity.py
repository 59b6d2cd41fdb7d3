"""From records at many demands to the demand at which an intersection jams."""

from pathlib import Path

import pytest
from factories.command_line import rightofway
from factories.records import junction, record
from factories.scenarios import ROOT, shipped
from hypothesis import given
from hypothesis import strategies as st

from benchmark.plumbing.errors import ScenarioError
from benchmark.records.capacity import Curve, capacity_curves, capacity_markdown
from benchmark.records.record import Record, Waiting
from benchmark.records.store import Store
from benchmark.records.table import records_table
from benchmark.scenario import catalogue


def at(demand: float, passed: float, seed: int = 1, **facts: object) -> Record:
    """An episode at a demand in which so many vehicles passed in an hour."""
    return record(scenario=f"test/a@{demand:g}", throughput=passed, seed=seed, **facts)


def curves(records: list[Record]) -> list[Curve]:
    return capacity_curves(records_table(records))


def test_an_episode_jams_when_fewer_than_two_thirds_get_through() -> None:
    (curve,) = curves([at(600, 401), at(900, 601), at(1200, 799)])
    assert curve == Curve("test/a", "c", 0.5, {600.0: 0.0, 900.0: 0.0, 1200.0: 1.0}, seeds=1)


@pytest.mark.parametrize(
    ("facts", "jams"),
    [
        ({"never_inserted": 6}, 1.0),
        ({"never_inserted": 5}, 0.0),
        ({"first_gridlock": 300.0, "gridlock_exposure": 300.0}, 1.0),
    ],
)
def test_it_jams_also_where_vehicles_never_entered_or_it_gridlocked(
    facts: dict[str, float], jams: float
) -> None:
    counted = Waiting(mean=1, p95=1, maximum=1, vehicles=100)
    (curve,) = curves([at(600, 600, waiting_time_per_vehicle=counted, **facts)])
    assert curve.jammed == {600.0: jams}


def test_the_capacity_is_the_greatest_demand_before_most_episodes_jam() -> None:
    found = curves(
        [
            at(demand, passed, seed)
            for demand, passed, seed in (
                *((300, 300, 1), (300, 300, 2)),
                *((600, 600, 1), (600, 10, 2)),  # half
                *((900, 10, 1), (900, 10, 2)),
                *((1200, 1200, 1), (1200, 1200, 2)),  # luck past the jam does not count
            )
        ]
    )
    assert [(curve.capacity, curve.seeds) for curve in found] == [(600.0, 2)]


def test_a_smallest_demand_that_jams_leaves_no_capacity() -> None:
    assert [curve.capacity for curve in curves([at(300, 10)])] == [None]


@given(st.dictionaries(st.integers(1, 5000), st.floats(0, 1), min_size=1))
def test_up_to_the_capacity_no_demand_jams_mostly(jammed: dict[int, float]) -> None:
    shares = {float(demand): share for demand, share in jammed.items()}
    found = Curve("test/a", "c", 0.5, shares, seeds=1).capacity
    lower = [share for demand, share in shares.items() if found and demand <= found]
    assert all(share <= 0.5 for share in lower)
    beyond = [demand for demand in sorted(shares) if found is None or demand > found]
    assert not beyond or shares[beyond[0]] > 0.5


def test_only_the_newest_record_of_an_episode_counts_and_failures_do_not() -> None:
    found = curves([at(600, 10), at(600, 600), at(600, 600, seed=2, status="failed")])
    assert [(curve.jammed, curve.seeds) for curve in found] == [({600.0: 0.0}, 1)]


def test_scenarios_at_their_own_demand_are_left_out() -> None:
    assert curves([record()]) == []


def test_junctions_are_not_added_up_but_left_out_and_named() -> None:
    both = {"N": junction(throughput=400.0), "S": junction(throughput=400.0)}
    notices: list[str] = []
    records = [record(scenario="test/a@600", junctions=both), at(600, 10, scenario_hash="b" * 64)]
    found = capacity_curves(records_table(records), notices.append)
    assert [curve.jammed for curve in found] == [{600.0: 1.0}]
    assert [line.partition(":")[0] for line in notices] == ["test/a"]


def test_the_table_has_a_row_for_each_controller_and_rate_and_a_column_for_each_demand() -> None:
    found = curves([at(600, 600, rate=0.05), at(900, 10, rate=0.05), at(600, 10, rate=None)])
    assert capacity_markdown(found).splitlines() == [
        "Share of episodes of test/a that jam, by total demand [veh/h], 1 seeds:",
        "",
        "| controller   |   RVs |   holds up to |   600 |   900 |",
        "|--------------|-------|---------------|-------|-------|",
        "| c            |   any |             - | 100 % |       |",
        "| c            |   5 % |           600 |   0 % | 100 % |",
    ]


@pytest.mark.usefixtures("without_workers")
def test_the_command_shows_where_the_runs_of_a_folder_jam(tmp_path: Path) -> None:
    study = ("smoke/crossing@300", "smoke/crossing@600", "--controller", "first-come")
    done = rightofway(tmp_path, "run", *study, "--rate", "0.5", "--seeds", "1")
    assert done.returncode == 0, done.stderr
    done = rightofway(tmp_path, "capacity")
    assert done.returncode == 0
    assert "| first-come   |  50 % |" in done.stdout
    assert "300 |   600 |" in done.stdout


def test_a_folder_without_such_runs_says_how_to_make_some(tmp_path: Path) -> None:
    store = Store(tmp_path / "out")
    store.prepare()
    store.append(record())
    done = rightofway(tmp_path, "capacity")
    assert done.returncode == 2
    assert "make some with `rightofway run 334@500" in " ".join(done.stderr.split())


def test_a_reference_with_a_demand_scales_every_count() -> None:
    (found,) = catalogue.find_scenarios(["334@700"])
    plain = shipped("colorado-springs/334")
    assert found.name == "colorado-springs/334@700"
    assert found.peak_demand == pytest.approx(700)
    assert found.hash != plain.hash
    ratio = 700 / plain.peak_demand
    for before, after in zip(plain.demand, found.demand, strict=True):
        for leg in plain.approaches.names():
            for turn in "LCR":
                scaled = ratio * before.counts(leg).of(turn)
                assert after.counts(leg).of(turn) == pytest.approx(scaled)


def test_a_folder_with_a_demand_scales_each_of_its_scenarios() -> None:
    found = catalogue.find_scenarios(["smoke@500", "smoke/tee"])
    assert [one.name for one in found] == [
        *("smoke/asymmetric@500", "smoke/crossing@500", "smoke/tee@500"),
        "smoke/tee",
    ]


def test_the_demand_that_a_scenario_has_leaves_its_meaning_as_it_is() -> None:
    plain = shipped("smoke/tee")
    assert plain.at_demand(plain.peak_demand).hash == plain.hash


@pytest.mark.parametrize("total", ["", "x", "0", "-5", "nan", "inf", "1e9"])
def test_a_demand_that_makes_no_sense_is_refused(total: str) -> None:
    with pytest.raises(
        ScenarioError, match=r'expected vehicles per hour behind the @, as in "334@'
    ):
        catalogue.find_scenarios([f"334@{total}"])


def test_a_file_with_an_at_in_its_name_is_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mine@home.toml"
    file.write_text((ROOT / "scenarios/smoke/tee.toml").read_text())
    (found,) = catalogue.find_scenarios([str(file)])
    assert found.name.endswith("/mine@home")

"""Ways to cheat an average waiting time: each is impossible, or flagged on the leaderboard."""

import csv
from collections.abc import Iterator, Sequence
from importlib import resources
from pathlib import Path

import pytest
from factories.command_line import rightofway
from factories.workers import without_workers
from plugins import install

from benchmark.control import plugins
from benchmark.records import leaderboard
from benchmark.records.leaderboard import Row
from benchmark.records.store import Store
from benchmark.reports import tables

CHEATS = (
    *("creeps", "removes", "asks-to-remove", "all-green", "all-yield", "no-clearance"),
    *("lights-off", "stops-to-hide"),
)
RECKLESS = ("all-go", "lights-dark")
"""What it takes minutes of traffic to regret."""

TEMPLATE = Path(str(resources.files("benchmark.commands"))) / "templates" / "my-scenario.toml"


def played(folder: Path, scenario: str, cheats: Sequence[str], code: int) -> Iterator[Path]:
    """Cheats beside the signal, on two seeds with RVs only."""
    names = [word for name in ("traffic-light", *cheats) for word in ("--controller", name)]
    with pytest.MonkeyPatch.context() as patch, without_workers():
        patch.syspath_prepend(install(folder / "installed", "cheats"))
        plugins.discovered.cache_clear()
        done = rightofway(folder, "run", scenario, "--rate", "1", "--seeds", "2", *names)
        assert done.returncode == code, done.stderr
        yield folder / "out"
    plugins.discovered.cache_clear()


def rows_of(results: Path) -> dict[str, Row]:
    return {row.controller: row for row in leaderboard.rows_of_records(Store(results).read())}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Some fail, and the others are not lost."""
    yield from played(tmp_path_factory.mktemp("fair-play"), "asymmetric", CHEATS, code=1)


@pytest.fixture(scope="module")
def rows(results: Path) -> dict[str, Row]:
    return rows_of(results)


@pytest.fixture(scope="module")
def reckless(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Row]]:
    """Where traffic is heavy for a quarter of an hour."""
    for folder in played(tmp_path_factory.mktemp("reckless"), str(TEMPLATE), RECKLESS, code=0):
        yield rows_of(folder)


def waits(row: Row) -> float:
    assert row.headline is not None
    return row.headline.mean


def test_creeping_waits_for_nothing_and_is_flagged(rows: dict[str, Row]) -> None:
    assert waits(rows["creeps"]) < 0.01 * waits(rows["traffic-light"])
    assert rows["creeps"].status == "flagged"
    assert {"creeps", "blocks"} <= {*rows["creeps"].marks}


def test_vehicles_that_disappear_fail_the_episode(rows: dict[str, Row]) -> None:
    row = rows["removes"]
    assert (row.status, row.headline) == ("failed", None)
    assert "vehicles were removed or made to stop past the rules" in row.reasons[0]


def test_to_ask_for_it_is_no_command_and_changes_nothing(results: Path) -> None:
    records = Store(results).read()
    light = {one.seed: one for one in records if one.controller == "traffic-light"}
    for one in (one for one in records if one.controller == "asks-to-remove"):
        (figures,), (other,) = one.junctions.values(), light[one.seed].junctions.values()
        assert [reason.rpartition(" (")[0] for reason in figures.refusals] == [
            "asks-to-remove: Remove refused: it is not a command; expected Go, Stop, Drive or Phase"
        ]
        assert figures.refused_commands > 0
        assert figures.average_waiting_time == other.average_waiting_time
        assert one.trips == light[one.seed].trips.model_copy(  # type: ignore[union-attr]
            update={"collisions_with_robot": one.trips.collisions_with_robot}  # type: ignore[union-attr]
        )


@pytest.mark.parametrize("name", ["all-green", "all-yield"])
def test_green_for_everybody_is_refused(rows: dict[str, Row], name: str) -> None:
    assert (rows[name].status, rows[name].headline) == ("failed", None)
    assert "conflict but are green together" in rows[name].reasons[0]


def assert_gridlocked(row: Row, beside: Row) -> None:
    assert waits(row) > waits(beside)
    assert row.status == "flagged"
    assert any(reason.startswith("gridlocks in ") for reason in row.reasons)
    assert row.figures["collisions"].mean > beside.figures["collisions"].mean


def test_go_for_everybody_crashes_and_gridlocks_and_is_flagged(reckless: dict[str, Row]) -> None:
    assert_gridlocked(reckless["all-go"], reckless["traffic-light"])
    assert reckless["all-go"].rules == "own"


def test_phases_that_follow_at_once_are_refused(rows: dict[str, Row]) -> None:
    assert (rows["no-clearance"].status, rows["no-clearance"].headline) == ("failed", None)
    assert "expected at least the 3.5 s" in rows["no-clearance"].reasons[0]


def test_lights_cannot_rule_and_be_off(rows: dict[str, Row]) -> None:
    assert (rows["lights-off"].status, rows["lights-off"].headline) == ("failed", None)
    assert "signal returned None where signals rule" in rows["lights-off"].reasons[0]


def test_dark_lights_are_shown_as_such_and_their_gridlock_flagged(
    reckless: dict[str, Row],
) -> None:
    assert_gridlocked(reckless["lights-dark"], reckless["traffic-light"])
    assert reckless["lights-dark"].rules != "lights"


def test_waiting_turned_into_stops_fails_the_episode(rows: dict[str, Row]) -> None:
    row = rows["stops-to-hide"]
    assert (row.status, row.headline) == ("failed", None)
    assert "vehicles were removed or made to stop past the rules" in row.reasons[0]


def test_every_cheat_stands_on_the_leaderboard_with_its_status(
    results: Path, rows: dict[str, Row]
) -> None:
    assert rows.keys() == {"traffic-light", *CHEATS}
    with (results / "leaderboard.csv").open() as file:
        written = {line["controller"]: line for line in csv.DictReader(file)}
    for name, row in rows.items():
        assert written[name]["status"] == row.status
        assert (written[name]["notes"] == "") == (name == "traffic-light")
    page = (results / "LEADERBOARD.md").read_text(encoding="utf-8")
    assert page == tables.leaderboard_markdown(list(rows.values()))

"""Episodes come out of their logs as they were, bit for bit, and without their controllers."""

from dataclasses import replace
from pathlib import Path

import polars
import pytest
from factories.logs import sealed
from factories.scenarios import shipped, smoke

from benchmark.control import plugins
from benchmark.records.record import Record
from benchmark.study import action_log, rescoring
from benchmark.study.actions import Action
from benchmark.study.episode import Episode

KINDS = {  # controllers of every sort of command
    "virtual-signal?clearance=5": 0.6,  # Go and Stop
    "time-windows": 0.6,  # Drive, with accelerations
    "wang": 0.6,  # learned
    "max-pressure": None,  # Phase
    "traffic-light-actuated": None,  # a program of its own, no commands
}


def logged(folder: Path, controller: str) -> tuple[Record, Path]:
    episode = Episode(smoke("asymmetric"), controller, KINDS[controller], 4)
    record = rescoring.run_logged(episode, folder)
    return record, folder / action_log.log_name(record.episode)


@pytest.mark.parametrize("controller", KINDS)
def test_a_record_comes_out_of_its_log_without_the_controller(
    tmp_path: Path, controller: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    record, path = logged(tmp_path, controller)
    monkeypatch.setattr(plugins, "find_controller", None)  # nobody looks for it
    log = action_log.read_log(path)
    again = rescoring.rescore(rescoring.LoggedEpisode.of(log))
    assert record.status == "ok"
    assert log.record == record
    assert again.model_copy(update={"wall_time": record.wall_time}) == record
    assert rescoring.differences(record, again) == []
    assert rescoring.versions_differ(record, again) is None


@pytest.mark.slow
def test_a_log_takes_as_little_room_as_the_docs_say(tmp_path: Path) -> None:
    for controller, most in (("virtual-signal", 25_000), ("time-windows", 60_000)):
        rescoring.run_logged(Episode(shipped("colorado-springs/334"), controller, 0.6, 1), tmp_path)
        (path,) = tmp_path.iterdir()
        assert path.stat().st_size < most  # docs/submissions.md
        path.unlink()


def test_another_command_makes_another_record(tmp_path: Path) -> None:
    record, path = logged(tmp_path, "virtual-signal?clearance=5")
    turned = {"go": "stop", "stop": "go"}
    actions = [Action(*row) for row in polars.read_parquet(path).iter_rows()]
    sealed(path, action_log.frame([a._replace(command=turned[a.command]) for a in actions]))
    again = rescoring.rescore(rescoring.LoggedEpisode.of(action_log.read_log(path)))
    found = rescoring.differences(record, again)
    assert any(one.startswith("junctions.intersection.average_waiting_time: ") for one in found)
    assert all(" there, " in one and one.endswith(" now") for one in found)


def test_versions_are_told_apart_from_figures() -> None:
    one = Episode(smoke("tee"), "c", 0.5, 1).record("ok")
    other = one.model_copy(update={"versions": one.versions.model_copy(update={"sumo": "1.27"})})
    assert rescoring.differences(one, other) == []
    assert rescoring.versions_differ(other, one) == f"sumo 1.27 there, {one.versions.sumo} now"


def test_an_episode_that_does_not_end_well_leaves_no_log(tmp_path: Path) -> None:
    skipped = replace(Episode(smoke("tee"), "traffic-light", None, 1))
    unlit = skipped.scenario.model_copy(update={"signal": None})
    record = rescoring.run_logged(replace(skipped, scenario=unlit), tmp_path)
    assert record.status == "skipped"
    assert list(tmp_path.iterdir()) == []

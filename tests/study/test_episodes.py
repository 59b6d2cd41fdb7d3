"""The suite: which episodes a study holds, and worker processes that survive bad controllers."""

import re
from collections import Counter
from itertools import product
from pathlib import Path

import psutil
import pytest
from factories.processes import PATIENCE
from factories.scenarios import smoke

from benchmark.control import plugins
from benchmark.plumbing.errors import ControllerError
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import all_episodes
from benchmark.study.pool import LocalPool

pytestmark = pytest.mark.usefixtures("hostile")

DOOMED = {
    "raises-in-act": (
        "failed",
        "act at 10 s raised ValueError: no idea\n[what] to do (hostile.py:",
    ),
    "raises-in-reset": ("failed", "reset raised KeyError: 'weights' (hostile.py:"),
    "returns-nonsense": ("failed", "returns-nonsense: act returned list; expected a mapping"),
    "lacks-weights": ("failed", "raised FileNotFoundError: weights.pt (hostile.py:"),
    "exits": ("failed", "act at 1 s raised SystemExit: SUMO_HOME is not set"),
    "crashes": ("crashed", "the worker process died (SIGSEGV)"),
}  # status and part of the reason


def test_episodes_are_ordered_by_scenario_controller_rate_and_seed() -> None:
    scenarios = [smoke("tee"), smoke("crossing")]
    controllers, rates, seeds = ["virtual-signal", "first-come"], [0.7, 0.2], [3, 1]
    found = all_episodes(scenarios, controllers, rates, seeds)
    wanted = product([one.name for one in scenarios], controllers, rates, seeds)
    assert [(e.scenario.name, e.controller, e.rate, e.seed) for e in found] == list(wanted)


def test_a_controller_that_commands_no_vehicle_runs_once_for_all_rates() -> None:
    names = ["traffic-light", "virtual-signal", "unsignalised"]
    found = all_episodes([smoke("tee")], names, [0.2, 0.7], [1])
    assert [(e.controller, e.rate) for e in found] == [
        ("traffic-light", None),
        ("virtual-signal", 0.2),
        ("virtual-signal", 0.7),
        ("unsignalised", None),
    ]


def test_rates_and_seeds_default_to_the_scenarios_own() -> None:
    found = all_episodes([smoke("tee")], ["virtual-signal"], None, None)
    assert [(e.rate, e.seed) for e in found] == [(0.5, 1), (0.5, 2)]


def test_an_unknown_controller_is_refused_before_anything_runs() -> None:
    with pytest.raises(ControllerError, match='"first-cone"; did you mean "first-come"'):
        all_episodes([smoke("tee")], ["virtual-signal", "first-cone"], None, None)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("exits-on-import", "cannot be imported: SystemExit: set HOSTILE_HOME first"),
        (
            "misspells-rules",
            'rules = \'signal\'; expected "signals", "stop signs" or "robot vehicles"',
        ),
        ("no-controller", "is not a benchmark.control.controller.Controller"),
    ],
)
def test_a_plugin_that_cannot_be_loaded_is_refused_by_name(name: str, reason: str) -> None:
    with pytest.raises(ControllerError, match=f'"{name}" .*{reason}'):
        plugins.load_class(name)


def test_an_episode_that_goes_wrong_is_recorded_with_its_reason_and_the_others_complete(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    good = [Episode(smoke("crossing"), "virtual-signal", 0.5, seed) for seed in range(len(DOOMED))]
    bad = [Episode(smoke("crossing"), name, 0.5, 1) for name in DOOMED]
    chosen = [one for pair in zip(bad, good, strict=True) for one in pair]
    records = [record for _, record in LocalPool(2).run(chosen)]
    assert Counter((one.controller, one.seed) for one in records) == Counter(
        (one.controller, one.seed) for one in chosen
    )
    for record in records:
        status, reason = DOOMED.get(record.controller, ("ok", ""))
        assert (record.status, record.rate) == (status, 0.5)
        assert reason in (record.reason or "")
        assert (record.trips is not None) == (status == "ok")
    assert not list(tmp_path.iterdir())  # those who died left no files either


def test_an_episode_that_hangs_has_timed_out_and_leaves_no_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    hangs = Episode(smoke("crossing"), "hangs", 0.5, 1)
    ((_, record),) = LocalPool(1, time_limit=1.0).run([hangs])
    assert (record.status, record.reason) == ("timed out", "not done after 1 s")
    assert not list(tmp_path.iterdir())


def test_commands_to_humans_are_counted_and_change_nothing() -> None:
    names = ("commands-humans", "mutates-state")
    chosen = [Episode(smoke("asymmetric"), name, 0.5, 1) for name in names]
    records = {record.controller: record for _, record in LocalPool(1).run(chosen)}
    refused, quiet = (records[name].junctions["intersection"] for name in names)
    assert refused.refused_commands > 100
    assert refused.refusals[0].startswith("commands-humans: Go refused: the vehicle is not")
    none = {"refused_commands": 0, "refusals": ()}
    assert refused.model_copy(update=none) == quiet
    assert records["commands-humans"].trips == records["mutates-state"].trips


def test_a_controller_cannot_change_what_it_receives() -> None:
    episode = Episode(smoke("tee"), "mutates-state", 0.5, 1)
    ((_, record),) = LocalPool(1).run([episode])
    assert (record.status, record.reason) == ("ok", None)
    assert record.scenario_hash == smoke("tee").hash


def test_a_suite_that_is_stopped_early_leaves_no_worker_behind() -> None:
    chosen = [Episode(smoke("tee"), name, 0.5, 1) for name in ("virtual-signal", "hangs")]
    running = LocalPool(2).run(chosen)
    assert next(running)[0].controller == "virtual-signal"
    running.close()
    children = psutil.Process().children(recursive=True)
    workers = [one for one in children if "spawn_main" in str(one.cmdline())]
    assert not psutil.wait_procs(workers, timeout=PATIENCE)[1]


def test_a_record_says_which_signal_program_ran() -> None:
    record = run_episode(Episode(smoke("tee"), "traffic-light-webster", None, 1))
    assert record.programs is not None
    assert re.fullmatch(
        r"fixed, cycle \d+ s \(yellow 3 s, all red 1 s\): .*N-L.* \d+ s",
        record.programs["intersection"],
    )
    assert run_episode(Episode(smoke("tee"), "unsignalised", None, 1)).programs is None

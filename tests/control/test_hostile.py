"""Controllers that attack the benchmark: isolated, each costs its own episode and nothing else."""

import ast
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from factories.processes import PATIENCE
from factories.scenarios import ROOT, smoke
from plugins import install

from benchmark.control import plugins
from benchmark.control.isolation import landlock, seccomp
from benchmark.control.isolation.limits import Limits
from benchmark.control.isolation.remote import RemoteGuard, ask_declaration
from benchmark.plumbing.errors import ControllerError
from benchmark.plumbing.files import cache_folder
from benchmark.records.record import Record
from benchmark.study.episode import Episode, run_episode
from benchmark.study.pool import LocalPool
from benchmark.sumo import demand, network

QUICK = Limits(step=0.5, start=PATIENCE)  # for those who never answer
ROOMY = Limits(step=PATIENCE, start=PATIENCE, memory=320)

needs_seccomp = pytest.mark.skipif(not seccomp.available(), reason="no seccomp filter here")
needs_landlock = pytest.mark.skipif(not landlock.version(), reason="no Landlock here")


@pytest.fixture(scope="module", autouse=True)
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where the villain is installed, here and in the processes that start here."""
    place = install(tmp_path_factory.mktemp("site") / "villain", "villain")
    secret = tmp_path_factory.mktemp("elsewhere") / "secret"
    secret.write_text("the seeds of the final")
    (place / "secret.txt").write_text(str(secret))
    (place / "victim.txt").write_text("alive")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(place)
        patch.setenv("RIGHTOFWAY_TEST_SECRET", "token")
        plugins.discovered.cache_clear()
        yield place
    plugins.discovered.cache_clear()


def attack(deed: str, limits: Limits = ROOMY, isolate: bool = True) -> Record:
    """An episode with a villain; whatever it was, no process of it is left."""
    before = set(psutil.Process().children(recursive=True))
    record = run_episode(Episode(smoke("tee"), f"villain?deed={deed}", 0.5, 1, isolate, limits))
    left = set(psutil.Process().children(recursive=True)) - before
    assert not psutil.wait_procs(left, timeout=PATIENCE)[1]
    return record


def figures(record: Record) -> tuple[object, object]:
    assert (record.status, record.reason) == ("ok", None)
    return record.junctions, record.trips


@pytest.mark.parametrize(
    "deed", [pytest.param("loop", marks=pytest.mark.slow), "loop-deaf", "trickle"]
)
def test_who_does_not_answer_in_time_is_timed_out(deed: str) -> None:
    record = attack(f"{deed}&begin=0", QUICK)
    assert (record.status, record.reason) == ("timed out", "act at 1 s: no answer within 0.5 s")


def test_who_never_begins_is_timed_out(monkeypatch: pytest.MonkeyPatch) -> None:
    reset = RemoteGuard.reset

    def hasty(guard: RemoteGuard, *given: Any) -> None:
        guard._limits = Limits(start=0.5)  # which the process needed to start
        reset(guard, *given)

    monkeypatch.setattr(RemoteGuard, "reset", hasty)
    record = attack("sleep-in-reset")
    assert (record.status, record.reason) == ("timed out", "reset: no answer within 0.5 s")


def test_a_sum_of_slow_answers_is_timed_out_too() -> None:
    record = attack("doze", Limits(step=PATIENCE, start=PATIENCE, episode=0.5))
    assert record.status == "timed out"
    assert "its answers took more than 0.5 s together" in str(record.reason)


DEEDS = [
    ("exit-hard", "crashed", "act at 3 s: the controller's process exited with code 3"),
    ("crash", "crashed", "act at 3 s: the controller's process was killed by SIGSEGV"),
    ("hoard", "failed", "act at 3 s raised MemoryError (villain.py:"),
    ("huge-answer", "failed", "MemoryError"),
    ("wrong-answer", "failed", "malformed answer: got Begun, expected Commands"),
    ("hang-up", "crashed", "act at 3 s: the controller's process closed its connection"),
    ("import-libsumo", "failed", "libsumo is out of reach for an isolated controller"),
]
ANSWERS = [
    ("exit", "failed", "act at 3 s raised SystemExit: enough (villain.py:"),
    ("list", "failed", "act returned list; expected a mapping of ids to commands"),
    ("raising-answer", "failed", "act at 3 s raised RuntimeError: no keys for you"),
    ("two-faced-answer", "failed", "act at 3 s raised ValueError: too many values to unpack"),
]
LIKE_OTHERS = [
    ("exit-hard-in-reset", "crashed", "reset: the controller's process exited with code 4"),
    ("kill-itself", "crashed", "act at 3 s: the controller's process was killed by SIGKILL"),
    ("many-commands", "failed", "act at 3 s: malformed answer: 1488905 bytes; at most 262144"),
    ("long-name", "failed", "act at 3 s: malformed answer: Expected `str` of length <= 200"),
    ("garbage", "failed", "act at 3 s: malformed answer: MessagePack data is malformed"),
    ("pickle", "failed", "act at 3 s: malformed answer: "),
    ("endless-frame", "failed", "act at 3 s: malformed answer: 4294967295 bytes; at most"),
]


@pytest.mark.parametrize(
    ("deed", "status", "reason", "isolate"),
    [
        *((*deed, True) for deed in DEEDS),
        *((*deed, False) for deed in ANSWERS),
        *(pytest.param(*deed, True, marks=pytest.mark.slow) for deed in (*ANSWERS, *LIKE_OTHERS)),
    ],
)
def test_what_a_villain_does_costs_its_episode(
    deed: str, status: str, reason: str, isolate: bool
) -> None:
    record = attack(deed, isolate=isolate)
    assert record.status == status
    assert reason in str(record.reason)
    assert record.junctions == {}


def test_who_gets_past_the_gate_finds_a_libsumo_without_a_simulation() -> None:
    record = attack("simulate", Limits(step=PATIENCE, start=PATIENCE))
    assert record.status == "failed"
    assert "raised FatalTraCIError: A network was not yet constructed." in str(record.reason)


def test_who_has_no_memory_left_to_say_so_ends_all_the_same() -> None:
    record = attack("hoard-silently", Limits(step=PATIENCE, start=PATIENCE, memory=512))
    assert record.status in ("failed", "crashed")


def told(record: Record) -> dict[str, object]:
    """What a villain found out and raised."""
    assert record.status == "failed"
    found: dict[str, object] = ast.literal_eval(
        str(record.reason).split("raised RuntimeError: ")[1].rpartition(" (")[0]
    )
    return found


@needs_seccomp
def test_other_processes_and_the_network_are_out_of_reach() -> None:
    deeds = ("fork", "spawn", "kill_the_runner", "kill_all", "connect", "outlive")
    denied = dict.fromkeys(deeds, "PermissionError")
    assert told(attack("reach-processes")) == {**denied, "raise_limit": "ValueError"}


@needs_landlock
def test_files_that_are_not_its_own_are_out_of_reach(site: Path) -> None:
    roads = network.build_network(smoke("tee"))
    routes = demand.build_routes(smoke("tee"), roads, 1).path
    assert cache_folder() in routes.parents
    (site / "cache.txt").write_text(str(routes))
    refused = ("PermissionError", "FileNotFoundError", "OSError")  # OSError: read-only
    found = told(attack("reach-files"))
    assert found.keys() == {"read_cache", "read_secret", "write", "delete"}
    assert all(outcome in refused for outcome in found.values()), found
    assert (site / "victim.txt").exists()


def test_it_finds_no_secrets_and_nothing_of_ours_open() -> None:
    found = told(attack("look-around"))
    kept = {"PATH", "LANG", "LC_ALL", "TZ", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH"}
    threads = {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"}
    environment = found.pop("environment")
    assert isinstance(environment, list)
    assert set(environment) - kept == {"HOME", "TMPDIR", "TORCHINDUCTOR_CACHE_DIR", *threads}
    assert found == {"descriptors": 1, "arguments": [], "folder": [], "runner": []}


@pytest.mark.parametrize(
    ("name", "start", "reason"),
    [
        ("sleeps-on-import", 0.5, 'import of "sleeps-on-import": no answer within 0.5 s'),
        ("exits-hard-on-import", PATIENCE, "the controller's process exited with code 5"),
        ("villain?deer=1", PATIENCE, "unknown key"),
    ],
)
def test_who_fails_on_import_is_refused_before_anything_runs(
    name: str, start: float, reason: str
) -> None:
    limits = Limits(start=start)
    with pytest.raises(ControllerError, match=reason):
        ask_declaration(name, limits)
    record = run_episode(Episode(smoke("tee"), name, 0.5, 1, True, limits))
    assert record.status in ("failed", "timed out", "crashed")
    assert reason in str(record.reason)


@pytest.mark.parametrize("deed", ["shout", "patch", "mutate"])
def test_some_deeds_change_nothing(deed: str) -> None:
    assert figures(attack(deed)) == figures(attack("nothing", isolate=False))


@pytest.mark.parametrize(
    ("deed", "reason"),
    [
        ("nan", "Drive refused: the acceleration is not a finite number"),
        ("no-text", "Go refused: the vehicle is not in the control zone"),
        pytest.param(
            *("no-number", "Drive refused: the acceleration is not a finite number"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("no-lane", "Drive refused: the lane change is not -1, 0 or 1"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("unknown-vehicle", "refused: the vehicle is not in the control zone"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_illegal_commands_are_refused_alike_isolated_and_not(deed: str, reason: str) -> None:
    alone, together = attack(deed), attack(deed, isolate=False)
    assert figures(alone) == figures(together)
    (junction,) = alone.junctions.values()
    assert junction.refused_commands > 0
    assert any(reason in one for one in junction.refusals)


def test_what_is_no_command_is_refused() -> None:
    (junction,) = attack("nonsense").junctions.values()
    (other,) = attack("nonsense", isolate=False).junctions.values()
    assert junction.refused_commands == other.refused_commands > 0
    assert any("str refused: it is not a command" in reason for reason in junction.refusals)
    assert junction.refusals == other.refusals


@pytest.mark.parametrize(
    "deeds",
    [
        {"exit-hard": "crashed", "nothing": "ok"},
        pytest.param(
            {
                "loop&begin=0": "timed out",
                "exit-hard": "crashed",
                "crash": "crashed",
                "hoard": "failed",
                "nothing": "ok",
            },
            marks=pytest.mark.slow,
        ),
    ],
    ids=len,
)
def test_a_suite_with_villains_completes_and_leaves_nothing(
    deeds: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    chosen = [
        Episode(smoke("tee"), f"villain?deed={deed}", 0.5, 1, True, limits)
        for deed, status in deeds.items()
        for limits in (QUICK if status == "timed out" else ROOMY,)
    ]
    records = [record for _, record in LocalPool(len(deeds) // 2).run(chosen)]
    assert {record.controller.partition("deed=")[2]: record.status for record in records} == deeds
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere it ends when it next answers")
def test_it_dies_with_its_runner(site: Path) -> None:
    code = (
        "import sys; sys.path[:0] = sys.argv[1:]; from factories.scenarios import ROOT, smoke; "
        "from benchmark.study.episode import Episode, run_episode; "
        "from benchmark.control.isolation.limits import Limits;"
        "limits = Limits(step=600.0, start=600.0);"
        "run_episode(Episode(smoke('tee'), 'villain?deed=loop-deaf', 0.5, 1, True, limits))"
    )
    here = str(ROOT / "tests")
    with psutil.Popen([sys.executable, "-c", code, str(site), here, str(Path.cwd())]) as runner:
        children: list[psutil.Process] = []
        deadline = time.monotonic() + PATIENCE
        while not any(child.cpu_times().user > 0.4 for child in children):  # it loops by now
            assert runner.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
            children = runner.children(recursive=True)
        runner.kill()
    assert not psutil.wait_procs(children, timeout=PATIENCE)[1]

"""Isolated controllers see and do the same as others: the channel, their processes, the command."""

import os
import pkgutil
import socket
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import psutil
import pytest
from factories.command_line import rightofway
from factories.episodes import live, mutable
from factories.processes import PATIENCE
from factories.scenarios import PAPER, SMOKE, shipped, smoke
from factories.traffic import crossing, state, vehicle
from hypothesis import given
from hypothesis import strategies as st
from plugins import install

import benchmark
from benchmark.control import plugins
from benchmark.control.commands import read_commands
from benchmark.control.controller import Drive, Go, Phase, Stop
from benchmark.control.declarations import Declaration
from benchmark.control.guard import ControllerFailedError
from benchmark.control.isolation import (
    channel,
    imports,
    landlock,
    namespace,
    process,
    remote,
    sandbox,
)
from benchmark.control.isolation.channel import Channel, MalformedError
from benchmark.control.isolation.child import Writer
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.readable import listed, readable
from benchmark.plumbing.errors import ControllerError
from benchmark.records.record import Record
from benchmark.scenario.scenario import Scenario
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import all_episodes
from benchmark.world.rules import Rules

ROOMY = Limits(step=PATIENCE, start=PATIENCE)
NO_NAMESPACE = process.START.replace(
    "from benchmark",
    "from benchmark.control.isolation import namespace; namespace.enter = lambda *_: False; "
    "from benchmark",
)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Where the villain is installed; it behaves unless told otherwise."""
    place = install(tmp_path / "site", "villain")
    monkeypatch.syspath_prepend(place)
    plugins.discovered.cache_clear()
    yield place
    plugins.discovered.cache_clear()


def both(scenario: Scenario, controller: str, rate: float | None = 0.5) -> tuple[Record, Record]:
    """An episode in this process and isolated, without the wall times."""
    here, apart = (
        run_episode(Episode(scenario, controller, rate, 3, isolate, ROOMY))
        for isolate in (False, True)
    )
    still = {"wall_time": 0.0, "identity": None}  # limits are part of it
    return here.model_copy(update=still), apart.model_copy(update=still)


@pytest.mark.parametrize(
    ("scenario", "controller"),
    [
        ("smoke/crossing", "max-pressure"),
        ("smoke/asymmetric", "virtual-signal?green=20"),
        ("smoke/asymmetric", "time-windows"),
        ("smoke/asymmetric", "wang-tuned"),
        ("smoke/tee", "hierarchical-tuned"),
        *(
            pytest.param(scenario, name, marks=pytest.mark.slow)
            for scenario in SMOKE
            for name in ("virtual-signal", "max-pressure")
            if (scenario, name) != ("smoke/crossing", "max-pressure")
        ),
    ],
)
def test_records_are_equal_bit_for_bit(scenario: str, controller: str) -> None:
    here, apart = both(shipped(scenario), controller)
    assert here.status in ("ok", "skipped")
    assert apart.line() == here.line()


def test_what_a_controller_raises_is_told_alike(site: Path) -> None:
    here, apart = both(smoke("tee"), "villain?deed=exit")
    assert here.reason == apart.reason
    assert here.reason is not None
    assert "act at 3 s raised SystemExit: enough (villain.py:" in here.reason


def test_a_controller_that_needs_the_network_says_that_it_is_out_of_reach() -> None:
    _, apart = both(smoke("asymmetric"), "traffic-light-webster", None)
    assert apart.status == "failed"
    assert "benchmark.sumo is out of reach for an isolated controller" in str(apart.reason)
    assert (apart.rules, apart.controller_from) == ("signals", plugins.provenance("traffic-light"))


@pytest.fixture
def ends() -> Iterator[tuple[Channel, Channel]]:
    """The runner's end and the controller's."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        yield (
            Channel(ours, channel.ANSWERS, channel.LARGEST),
            Channel(theirs, channel.QUESTIONS),
        )


@pytest.mark.parametrize("name", ["first-come", "max-pressure"])
def test_states_arrive_as_they_were_and_cannot_be_changed(
    ends: tuple[Channel, Channel], name: str
) -> None:
    _, states, _ = live("smoke/asymmetric", name)
    runner, controller = ends
    runner.send(channel.Begin(3, {"one": states[0].intersection}))
    (intersection,) = map(channel.read_only, controller.receive().junctions.values())
    assert intersection == states[0].intersection
    assert repr(intersection.lanes) == repr(states[0].intersection.lanes)
    assert any(one.vehicles for one in states)
    assert any(one.inside for one in states)
    known: set[int] = set()
    for sent in states:
        runner.send(channel.See("one", sent.time, sent.vehicles, sent.inside, sent.phase))
        seen = controller.receive().state(intersection)
        assert seen == sent
        assert repr((seen.time, seen.vehicles, seen.inside, seen.phase)) == repr(
            (sent.time, sent.vehicles, sent.inside, sent.phase)
        )
        assert not list(mutable(seen, "state", known))


@pytest.mark.parametrize("name", [*SMOKE, *PAPER])
def test_scenarios_arrive_as_they_were(name: str) -> None:
    for one in (shipped(name), shipped(name).at_demand(700.0)):
        copy = channel.Ask.about(one).scenario()
        assert (copy, copy.hash, copy.name) == (one, one.hash, one.name)


numbers = st.floats() | st.integers(-5, 5) | st.booleans() | st.none() | st.text(max_size=3)
commands = st.dictionaries(
    st.text(max_size=5) | st.integers(),
    st.builds(Go)
    | st.builds(Stop)
    | st.builds(Drive, numbers, numbers)
    | st.builds(Phase, st.text(max_size=5))
    | numbers,
    max_size=5,
)


@given(commands)
def test_commands_come_out_of_the_channel_with_the_same_meaning(given: dict[Any, Any]) -> None:
    """Whatever a controller answers, the rules make the same of it and refuse as much."""
    robots = (vehicle("a"), vehicle("b", movement="E-L", speed=0.0), vehicle("", distance=90.0))
    now = state(*robots, crossing())
    written = msgspec.msgpack.encode(Writer("test").decide(now, given))
    answer = msgspec.msgpack.decode(written, type=channel.Commands)
    copy = read_commands(answer.commands)
    here, apart = (Rules(now.intersection, "test", "flexible", True) for _ in range(2))
    assert here.decide(now, given) == apart.decide(now, copy)
    assert here.refusals.total() == apart.refusals.total()


def framed(data: bytes) -> bytes:
    return len(data).to_bytes(channel.HEADER) + data


@given(st.binary(max_size=60), st.booleans())
def test_whatever_arrives_is_an_answer_or_malformed(data: bytes, whole: bool) -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(framed(data) if whole else data)
        theirs.shutdown(socket.SHUT_WR)
        try:
            answer = Channel(ours, channel.ANSWERS, channel.LARGEST).receive()
        except (MalformedError, EOFError):
            return
        assert isinstance(answer, channel.ANSWERS)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"\xff\xff\xff\xff", "4294967295 bytes; at most"),
        ((2_000_000).to_bytes(channel.HEADER), "2000000 bytes; at most"),
        (framed(b"\xc1\xc1\xc1\xc1"), "MessagePack data is malformed"),
        (framed(b"\x80\x04cos\n_exit\n."), "."),
        (
            framed(msgspec.msgpack.encode(Writer("test").decide(state(), {"x" * 10_000: Go()}))),
            "Expected `str` of length <= 200",
        ),
    ],
)
def test_an_answer_that_is_none_is_told(answer: bytes, words: str) -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(answer)
        with pytest.raises(MalformedError, match=words):
            Channel(ours, channel.ANSWERS, channel.LARGEST).receive()


def test_a_deadline_holds_for_those_who_do_not_read(ends: tuple[Channel, Channel]) -> None:
    runner, _ = ends
    question = channel.Open("x" * 1_000_000, "", (), (), (), 1, 1)
    began = time.perf_counter()
    with pytest.raises(TimeoutError):
        runner.send(question, began + 0.2)
    assert time.perf_counter() - began < PATIENCE


def test_of_benchmark_only_what_the_contract_needs_can_be_imported() -> None:
    modules = {module.name for module in pkgutil.walk_packages(benchmark.__path__, "benchmark.")}
    reachable = {module for module in modules if imports.is_open(module)}
    assert {name.split(".")[1] for name in reachable} == {*imports.ROOMS, "learning"}
    assert {name for name in reachable if ".learning" in name} == imports.FILES
    gate = imports.Gate()
    for name in reachable | {"numpy", "baselines.wang.controller"}:
        assert gate.find_spec(name, None) is None
    for name in (modules - reachable) | {"libsumo", "traci", "traci.constants", "sumolib.net"}:
        with pytest.raises(ImportError, match=f"{name} is out of reach for an isolated"):
            gate.find_spec(name, None)


def test_it_is_ended_with_all_that_it_has_started(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        process, "START", "import os, time; [os.fork() for _ in range(2)]; time.sleep(3600)"
    )
    one = process.Process()
    leader = psutil.Process(one._process.pid)
    deadline = time.monotonic() + PATIENCE
    while len(members := [leader, *leader.children(recursive=True)]) < 4:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    one.close()
    assert not psutil.wait_procs(members, timeout=PATIENCE)[1]


def test_an_impostor_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    said = Declaration("virtual-signal", "robot vehicles", "own", True, (0.0, 1.0), None)
    monkeypatch.setattr(process.Process, "ask", lambda *_: channel.Declared(said))
    with pytest.raises(ControllerError, match='"first-come": it says it is "virtual-signal"'):
        remote.ask_declaration("first-come", Limits(step=3.0))


def test_what_is_not_installed_is_isolated_unless_wished_otherwise() -> None:
    assert not remote.isolated("virtual-signal?green=20", None)
    assert not remote.isolated("wang?weights=C:/weights", None)
    for reference in ("my/file.py:Mine", "package.module:Mine?green=20"):
        assert remote.isolated(reference, None)
        assert not remote.isolated(reference, False)
    assert remote.isolated("virtual-signal", True)


def test_a_look_at_an_isolated_controller_spells_its_options_as_elsewhere() -> None:
    found = [
        remote.declaration_of("virtual-signal?green=20.0", isolate, DEFAULT)
        for isolate in (True, False)
    ]
    assert [(one.reference, one.label) for one in found] == [("virtual-signal?green=20",) * 2] * 2
    assert found[0] == found[1]


MINE = """
import sys
from collections.abc import Mapping
from pathlib import Path

from benchmark.control.controller import Command, Controller, Go
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState

sys.modules["apart_was_here"] = sys


class Mine(Controller):
    rates = (0.3, 1.0)
    approaches = {3, 4}

    def __init__(self, greeting: str = "hello") -> None:
        self.weights_hash = (Path(__file__).parent / "weights.txt").read_text() + greeting

    def reset(self, intersection: Intersection, seed: int) -> None:
        pass

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {one.id: Go() for one in state.deciding}
"""


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A controller in a file, with weights beside it, in the folder where the user is."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "weights.txt").write_text("w")
    (tmp_path / "apart.py").write_text(MINE)
    return tmp_path / "apart.py"


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize("reference", ["apart.py:Mine", "apart:Mine"])
def test_files_and_modules_run_apart_and_are_not_imported_here(
    reference: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    chosen = all_episodes(
        [smoke("tee")], [f"{reference}?greeting=you"], [0.2, 0.5], [1], limits=ROOMY
    )
    low, record = map(run_episode, chosen)
    assert "apart_was_here" not in sys.modules
    assert (record.status, record.weights_hash) == ("ok", "wyou")
    assert record.controller == f"{reference}?greeting=you"
    assert "apart.py sha256:" in str(record.controller_from)
    assert (low.status, low.reason) == ("skipped", "it needs 30 to 100 % RVs, and the rate is 20 %")
    wished = replace(chosen[1], isolate=False)
    still = {"wall_time": 0.0, "identity": None}
    assert run_episode(wished).model_copy(update=still) == record.model_copy(update=still)
    assert sys.modules.pop("apart_was_here") is sys
    sys.modules.pop("apart", None)


def test_a_file_that_loops_holds_nobody_up(mine: Path) -> None:
    mine.write_text("while True: pass")
    with pytest.raises(ControllerError, match=r'import of "apart.py:Mine": no answer within 0.5 s'):
        all_episodes([smoke("tee")], ["apart.py:Mine"], [0.5], [1], limits=Limits(start=0.5))


@pytest.mark.usefixtures("without_workers")
def test_the_command_isolates_and_keeps_the_limits(mine: Path, tmp_path: Path) -> None:
    mine.write_text(MINE.replace("        return", "        while True: pass\n        return"))
    study = ("run", "smoke/tee", "--controller", "apart.py:Mine", "--seed", "1")
    done = rightofway(tmp_path, *study, "--step-limit", "0.5")
    assert done.returncode == 1, done.stderr
    told = " ".join(done.stderr.split())
    assert "apart.py:Mine: 1 timed out" in told
    assert "act at 1 s: no answer within 0.5 s" in told


def test_the_cache_is_never_readable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hidden = tmp_path / "work" / "cache" / "rightofway"
    for folder in (hidden, tmp_path / ".ssh", tmp_path / "work" / "weights"):
        folder.mkdir(parents=True)
    (tmp_path / "apart.py").write_text("")
    monkeypatch.setenv("RIGHTOFWAY_CACHE", str(hidden))
    monkeypatch.syspath_prepend(hidden / "networks")
    found = {Path(one) for one in readable(f"{tmp_path}/apart.py:Mine?weights={hidden}/x")}
    inside = {one.relative_to(tmp_path) for one in found if tmp_path in one.parents}
    assert inside == {Path("apart.py"), Path("work/weights")}
    monkeypatch.setenv("RIGHTOFWAY_CACHE", str(tmp_path.parent / "elsewhere"))
    assert str(tmp_path) in readable(f"{tmp_path}/apart.py:Mine")


def test_of_a_clone_only_packages_are_readable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("mine", "results", "out", ".git", "other.dist-info", "libs"):
        (tmp_path / "clone" / name).mkdir(parents=True)
        (tmp_path / "clone" / name / "some.txt").write_text("")
    for name in ("mine/__init__.py", "single.py", "notes.txt", ".env", "key.pem"):
        (tmp_path / "clone" / name).write_text("")
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path / "clone")])
    found = {Path(one) for one in readable("first-come")}
    inside = {one.name for one in found if tmp_path in one.parents}
    assert inside == {"mine", "single.py", "other.dist-info"}
    assert str(tmp_path / "clone") in listed()
    packages = Path(pytest.__file__).parents[1]
    assert str(packages) in map(str, found)
    assert str(packages) not in listed()


CLONE = """
from pathlib import Path
import mine
from benchmark.control.controller import Controller

found = {}
for name in ("results/record", "out/record", ".git/config", ".env"):
    try:
        found[name] = Path(CLONE, name).read_text()
    except OSError as error:
        found[name] = "out of reach"
raise RuntimeError(f"{mine.HERE} {set(found.values())}")
"""


@pytest.mark.skipif(
    not (landlock.version() or namespace.available()), reason="neither Landlock nor namespaces"
)
@pytest.mark.parametrize("has_namespace", [True, False])
def test_a_clones_package_is_imported_and_its_results_are_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_namespace: bool
) -> None:
    clone = tmp_path / "clone"
    for name in ("results/record", "out/record", ".git/config", ".env", "mine/__init__.py"):
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        (clone / name).write_text("HERE = 'imported'")
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "look.py").write_text(CLONE.replace("CLONE", repr(str(clone))))
    monkeypatch.setattr(sys, "path", [*sys.path, str(clone)])
    if not has_namespace:
        if not landlock.version():
            pytest.skip("no Landlock here")
        monkeypatch.setattr(process, "START", NO_NAMESPACE)
    with pytest.raises(ControllerFailedError, match=r"imported \{'out of reach'\}"):
        remote.Remote(f"{tmp_path}/own/look.py:Look", ROOMY)


def test_options_that_are_paths_begin_where_the_user_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from baselines.wang.controller import SHIPPED

    (tmp_path / "mine.safetensors").write_bytes((SHIPPED / "wang.safetensors").read_bytes())
    monkeypatch.chdir(tmp_path)
    here, apart = both(smoke("tee"), "wang?weights=mine.safetensors")
    assert (here.status, apart.line()) == ("ok", here.line())


LEARNT = """
import io
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from stable_baselines3 import PPO

from benchmark.control.controller import Command, Controller, Go
from benchmark.control.intersection import Intersection
from benchmark.control.state import TrafficState


class Learnt(Controller):
    def __init__(self, to_file: bool = True) -> None:
        model = PPO("MlpPolicy", "CartPole-v1", n_steps=8, batch_size=8, device="cpu", seed=1)
        seen = np.zeros(4, dtype=np.float32)
        if to_file:
            place = Path(tempfile.mkdtemp()) / "model.zip"
            model.save(place)
        else:
            place = io.BytesIO()
            model.save(place)
            place.seek(0)
        loaded = PPO.load(place, device="cpu")
        wanted, _ = model.predict(seen, deterministic=True)
        action, _ = loaded.predict(seen, deterministic=True)
        assert action == wanted
        self.weights_hash = f"same action {int(action) == int(wanted)}"

    def reset(self, intersection: Intersection, seed: int) -> None:
        pass

    def act(self, state: TrafficState) -> Mapping[str, Command]:
        return {one.id: Go() for one in state.deciding}
"""
BIG = Limits(step=PATIENCE, start=PATIENCE, memory=6000)


@pytest.mark.parametrize("has_namespace", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_model_of_stable_baselines_is_saved_and_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, has_namespace: bool
) -> None:
    if has_namespace and not namespace.available():
        pytest.skip("no mount namespace here")
    if not has_namespace:
        monkeypatch.setattr(process, "START", NO_NAMESPACE)
    (tmp_path / "learnt.py").write_text(LEARNT)
    reference = f"{tmp_path}/learnt.py:Learnt?to_file={str(has_namespace).lower()}"
    with remote.Remote(reference, BIG) as one:
        assert one.decider(smoke("tee")).weights_hash == "same action True"


NOTE = """
import os
from pathlib import Path
from benchmark.control.controller import Controller

place = Path(os.environ["TMPDIR"])
before = sorted(path.name for path in place.iterdir())
(place / "note").write_text("seen")
fuller = [*place.iterdir()]
for number in range(5000):
    try:
        (place / f"n{number}").touch()
    except OSError as error:
        break
raise RuntimeError(f"before {before}, after {len(fuller)}, full {number < 4999}")
"""


@pytest.mark.skipif(not namespace.available(), reason="no mount namespace here")
def test_temporary_files_are_few_and_gone_at_the_next_episode(tmp_path: Path) -> None:
    (tmp_path / "note.py").write_text(NOTE)
    for _ in range(2):
        with pytest.raises(ControllerFailedError, match=r"before \[\], after 1, full True"):
            remote.Remote(f"{tmp_path}/note.py:Note", ROOMY)


def test_systems_without_isolation_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "name", "nt")
    with pytest.raises(ControllerError, match="run what you trust with --no-isolate"):
        process.Process()


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ("namespace.available", "see which paths exist"),
        ("seccomp.available", "start and signal processes"),
    ],
)
def test_what_is_missing_is_said(part: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before = [*sandbox.missing()]
    name = f"benchmark.control.isolation.sandbox.{part}"
    monkeypatch.setattr(name, lambda: False)
    (line,) = [*{*sandbox.missing()} - {*before}] or [one for one in before if words in one]
    assert line.startswith(words)


def test_root_is_told_where_its_privileges_cannot_be_dropped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("benchmark.control.isolation.sandbox.sys.platform", "darwin")
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert any(line.startswith("do what root may do") for line in sandbox.missing())
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert not any(line.startswith("do what root may do") for line in sandbox.missing())

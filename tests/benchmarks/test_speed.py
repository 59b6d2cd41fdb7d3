"""Speed and memory, measured: ``pytest tests/benchmarks --benchmark-only --benchmark-enable``.

Timings mean something only on a machine with nothing else to do. What is compared runs by turns,
and the fastest of each counts.
"""

import multiprocessing
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest
from factories.scenarios import PAPER, shipped
from pytest_benchmark.fixture import BenchmarkFixture

from baselines.wang.controller import Wang
from baselines.wang.policy import Greedy
from benchmark.control import plugins
from benchmark.learning.rollout import Rollout, Workers
from benchmark.scenario import catalogue
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import all_episodes, build_ahead
from benchmark.study.pool import LocalPool
from benchmark.sumo import demand, network, signals, tools
from benchmark.sumo.simulation import FLAGS
from benchmark.world.world import World

ROUNDS = 9
SCENARIO = "colorado-springs/334"
COMMAND = Path(sys.executable).parent / "rightofway"


@pytest.fixture(autouse=True)
def _only_when_measuring(benchmark: BenchmarkFixture) -> None:
    if benchmark.disabled:
        pytest.skip("benchmarks are disabled; see the top of the file")


@pytest.fixture
def worker() -> Iterator[ProcessPoolExecutor]:
    """A fresh process such as a suite's workers are, without what pytest keeps in memory."""
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(max_workers=1, mp_context=spawn) as pool:
        yield pool


def seconds(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


UNLIKE_BARE = ("--tripinfo", "--device.emissions", "--xml-validation")


def bare_sumo(seed: int) -> list[str]:
    """The program ``sumo`` on the same network, routes, lights, steps and checks; no outputs.

    Its validation of XML files, which episodes turn off, stays on as it is by default.
    """
    scenario = shipped(SCENARIO)
    roads = network.build_network(scenario)
    evaluation = scenario.evaluation
    flags = {flag: value for flag, value in FLAGS.items() if not flag.startswith(UNLIKE_BARE)}
    assert {"--collision.action", "--collision.check-junctions"} <= set(flags)
    return [
        str(tools.program_path("sumo")),
        *("-n", str(roads.path), "-r", str(demand.build_routes(scenario, roads, seed).path)),
        *("-a", str(signals.program_file(scenario.programs, roads))),
        *("--step-length", f"{evaluation.step:g}", "--end", f"{evaluation.duration:g}"),
        *("--seed", str(seed), *(part for flag in flags.items() for part in flag)),
    ]


@pytest.mark.parametrize(
    ("controller", "rate", "limit"),
    [
        ("traffic-light", None, 1.4),
        ("virtual-signal", 0.6, 2.0),
        ("time-windows", 0.6, 2.5),
        ("wang", 0.6, 2.5),
        ("hierarchical", 0.6, 3.0),
    ],
)
def test_an_episode_takes_little_longer_than_bare_sumo(
    benchmark: BenchmarkFixture,
    worker: ProcessPoolExecutor,
    controller: str,
    rate: float | None,
    limit: float,
) -> None:
    episode = Episode(shipped(SCENARIO), controller, rate, seed=1)
    command, environment = bare_sumo(seed=1), tools.sumo_environment()
    assert worker.submit(run_episode, episode).result().status == "ok"  # all is warm from here on
    bare: list[float] = []

    def bare_first() -> None:
        bare.append(seconds(lambda: subprocess.run(command, env=environment, check=True)))

    benchmark.pedantic(
        lambda: worker.submit(run_episode, episode).result(), setup=bare_first, rounds=ROUNDS
    )
    assert benchmark.stats is not None
    ratio = benchmark.stats.stats.min / min(bare)
    benchmark.extra_info |= {"bare sumo [s]": min(bare), "ratio": ratio, "limit": limit}
    print(f"{controller}: {ratio:.2f} times bare sumo ({min(bare):.2f} s)")  # noqa: T201
    assert ratio <= limit


def test_two_workers_are_nearly_twice_as_fast_as_one(benchmark: BenchmarkFixture) -> None:
    chosen = all_episodes([shipped(SCENARIO)], ["virtual-signal"], [0.6], range(1, 21))
    build_ahead(chosen)

    def suite(workers: int) -> None:
        assert {record.status for _, record in LocalPool(workers).run(chosen)} == {"ok"}

    alone: list[float] = []
    benchmark.pedantic(
        suite, args=(2,), setup=lambda: alone.append(seconds(lambda: suite(1))), rounds=3
    )
    assert benchmark.stats is not None
    ratio = min(alone) / benchmark.stats.stats.min
    benchmark.extra_info |= {"one worker [s]": min(alone), "ratio": ratio}
    print(f"two workers: {ratio:.2f} times as fast as one")  # noqa: T201
    assert ratio >= 1.8


def bare_libsumo(rollout: Rollout) -> None:
    """The traffic of a rollout with nobody who looks or decides."""
    evaluation = rollout.scenario.evaluation
    with World(rollout.scenario, rollout.rate, rollout.seed, controller="bare") as world:
        for _ in range(round(evaluation.duration / evaluation.step)):
            world._simulation.step()


@pytest.mark.parametrize("workers", [1, 2])
def test_training_traffic_is_fast(benchmark: BenchmarkFixture, workers: int) -> None:
    """Steps and decisions a second under the shipped policy, beside bare libsumo.

    At a demand that does not jam when nobody decides, so that both simulate the same traffic.
    """
    (scenario,) = catalogue.find_scenarios([f"{SCENARIO}@1400"])
    rollouts = [Rollout(scenario, 0.6, seed, gridlock_after=None) for seed in range(1001, 1013)]
    policy = Greedy(Wang()._weights.arrays)
    for rollout in rollouts:
        demand.build_routes(scenario, network.build_network(scenario), rollout.seed)
    spawn = multiprocessing.get_context("spawn")
    with Workers(workers) as pool, ProcessPoolExecutor(workers, mp_context=spawn) as others:
        played = [one.result() for one in pool.play(rollouts, policy)]  # all is warm from here on
        list(others.map(bare_libsumo, rollouts))
        bare: list[float] = []
        benchmark.pedantic(
            lambda: [one.result() for one in pool.play(rollouts, policy)],
            setup=lambda: bare.append(seconds(lambda: list(others.map(bare_libsumo, rollouts)))),
            rounds=3,
        )
    assert benchmark.stats is not None
    took = benchmark.stats.stats.min
    steps = sum(one.steps for one in played)
    decisions = sum(len(path.actions) for one in played for path in one.trajectories)
    benchmark.extra_info |= {
        "workers": workers,
        "steps/s": steps / took,
        "decisions/s": decisions / took,
        "bare libsumo steps/s": steps / min(bare),
    }
    print(  # noqa: T201
        f"{workers} workers: {steps / took:.0f} steps/s, {decisions / took:.0f} decisions/s; "
        f"bare libsumo {steps / min(bare):.0f} steps/s"
    )
    assert steps / took >= 300


def peak_memory(chosen: list[Episode]) -> float:
    """The most memory that this process had after these episodes [MB].

    From /proc, because getrusage counts what the process that spawned this one had.
    """
    assert {run_episode(one).status for one in chosen} == {"ok"}
    status = Path("/proc/self/status").read_text().splitlines()
    (peak,) = (line.split()[1] for line in status if line.startswith("VmHWM"))
    return int(peak) * 1024 / 1e6


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_worker_stays_below_400_mb(
    benchmark: BenchmarkFixture, worker: ProcessPoolExecutor
) -> None:
    chosen = all_episodes(
        [shipped(name) for name in PAPER],
        [name for name in plugins.discovered() if name != "unsignalised"],
        [0.5],
        [1],
    )
    build_ahead(chosen)
    peak = benchmark.pedantic(lambda: worker.submit(peak_memory, chosen).result(), rounds=1)
    benchmark.extra_info["peak memory [MB]"] = peak
    print(f"peak memory of a worker: {peak:.0f} MB")  # noqa: T201
    assert peak < 400


@pytest.mark.parametrize("argument", ["--help", "list"])
def test_the_command_answers_at_once(benchmark: BenchmarkFixture, argument: str) -> None:
    command = [str(COMMAND), argument]
    benchmark.pedantic(
        lambda: subprocess.run(command, check=True, capture_output=True), rounds=ROUNDS
    )
    assert benchmark.stats is not None
    print(f"{argument}: {benchmark.stats.stats.min:.2f} s")  # noqa: T201
    assert benchmark.stats.stats.min < 0.5

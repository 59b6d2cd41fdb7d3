"""What suites cost beyond one machine: ``make scaling``.

Measures an episode, a worker, the store and the scheduler on this machine, and says from these what
10^5 and 10^7 episodes need; docs/scaling.md keeps what it said. Where it can it tells processor
time, which depends less than wall time on what else the machine does.
"""

import operator
import os
import pickle
import resource
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING

import psutil

from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.scenario import catalogue
from benchmark.study.cluster import connection, environment
from benchmark.study.cluster.executor import Cluster
from benchmark.study.cluster.stream import Stream
from benchmark.study.cluster.worker import Job
from benchmark.study.episode import Episode, run_episode
from benchmark.study.episodes import build_ahead
from benchmark.study.executor import Executor
from benchmark.study.outcome import Outcome
from benchmark.study.pool import LocalPool
from benchmark.sumo import demand, network

if TYPE_CHECKING:
    from distributed import Client

RESULTS = Path(__file__).parents[2] / "results"
PAPER = ("229", "332", "334", "449")
CONTROLLERS = ("traffic-light", "virtual-signal", "wang", "hierarchical-tuned")
RATE = 0.6
ROUNDS = 3  # of which the best counts
THREADS = 4  # of the worker that does nothing
SIZES = (10**5, 10**7)  # episodes
CORES = (64, 1024)


def megabytes(size: float) -> float:
    return size / 2**20


def every() -> list[Episode]:
    """One episode of each scenario and controller."""
    scenarios = [catalogue.find_scenarios([name])[0] for name in PAPER]
    return [Episode(one, name, RATE, 1) for one, name in product(scenarios, CONTROLLERS)]


@dataclass(frozen=True)
class Cost:
    """What an episode takes where it runs."""

    processor: float  # s
    memory: float  # MB, the most that the process of several had
    routes: float  # MB of the cache for one scenario and seed

    @classmethod
    def measured(cls) -> "Cost":
        """In a fresh process, with a fresh cache."""
        with tempfile.TemporaryDirectory() as folder:
            os.environ["RIGHTOFWAY_CACHE"] = folder
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
                times = [process.submit(_processor_time).result() for _ in range(ROUNDS)]
                memory = process.submit(_most_memory).result()
            sizes = [one.stat().st_size for one in Path(folder, "routes").rglob("*.*")]
        return cls(min(times), memory, megabytes(sum(sizes)) / len(PAPER))


def _processor_time() -> float:
    chosen = every()
    for one in chosen:
        demand.build_routes(one.scenario, network.build_network(one.scenario), one.seed)
    began = time.process_time()
    assert {run_episode(one).status for one in chosen} == {"ok"}
    return (time.process_time() - began) / len(chosen)


def _most_memory() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def appended_a_second(records: list[Record]) -> float:
    """Records that one process puts on the disk here, each before the next."""
    with tempfile.TemporaryDirectory(dir=".") as folder:
        store = Store(Path(folder))
        store.prepare()
        began = time.perf_counter()
        for one in records:
            store.append(one)
        return len(records) / (time.perf_counter() - began)


@dataclass(frozen=True)
class Load:
    """What tasks take that do nothing."""

    wall: float  # s a task
    scheduler: float  # s of processor time a task
    command: float  # the same, of the process that sends tasks and takes results
    scheduler_memory: float  # MB, the most while they ran
    command_memory: float  # MB
    most: int  # tasks under way at a time

    @classmethod
    def measured(cls, count: int, record: Record) -> "Load":
        """Tasks as large as episodes, whose results are records, through a scheduler of its own."""
        wanted, job = environment.needed(CONTROLLERS), pickle.dumps(Job(every()[0], 600.0, None))
        with elsewhere() as (client, scheduler):
            command = psutil.Process()
            before = [sum(one.cpu_times()[:2]) for one in (scheduler, command)]
            began, peaks, sent, most = time.perf_counter(), [0.0, 0.0], 0, 0
            stream: Stream[int] = Stream(client, operator.getitem)
            while sent < count or len(stream):
                while sent < count and stream.has_room():
                    stream.submit(sent, (record, wanted, job), 0)
                    sent += 1
                most = max(most, len(stream))
                for number, result in stream.ended():
                    assert result == record
                    if number % 1000 == 0:
                        sizes = [one.memory_info().rss for one in (scheduler, command)]
                        peaks = [max(a, megabytes(b)) for a, b in zip(peaks, sizes, strict=True)]
            wall = time.perf_counter() - began
            after = [sum(one.cpu_times()[:2]) for one in (scheduler, command)]
        spent = [(b - a) / count for a, b in zip(before, after, strict=True)]
        return cls(wall / count, spent[0], spent[1], peaks[0], peaks[1], most)


@contextmanager
def elsewhere() -> "Iterator[tuple[Client, psutil.Process]]":
    """A client of a scheduler and a worker in processes of their own, and the scheduler."""
    with ExitStack() as ends, tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scheduler.json"
        common = ("--no-dashboard", "--scheduler-file", str(file))
        scheduler = _started("scheduler", "--host", "127.0.0.1", "--port", "0", *common)
        ends.enter_context(_ended(scheduler))
        while not (file.exists() and file.read_text()):
            time.sleep(0.1)
        worker = _started("worker", "--no-nanny", "--nthreads", str(THREADS), *common)
        ends.enter_context(_ended(worker))
        client = ends.enter_context(connection.running(connection.address_in(file)))
        client.wait_for_workers(1)
        yield client, psutil.Process(scheduler.pid)


def _started(part: str, *options: str) -> subprocess.Popen[bytes]:
    script = f"from distributed.cli.dask_{part} import main; main()"
    return subprocess.Popen([sys.executable, "-c", script, *options], stderr=subprocess.DEVNULL)


@contextmanager
def _ended(process: subprocess.Popen[bytes]) -> Iterator[None]:
    try:
        yield
    finally:
        process.kill()
        process.wait()


def overhead(executor: Executor, count: int) -> float:
    """Wall time that one worker spends on an episode beside running it [s]."""
    scenario = catalogue.find_scenarios(["smoke/crossing"])[0]
    chosen = [Episode(scenario, "virtual-signal", RATE, seed) for seed in range(1, count + 1)]
    build_ahead(chosen)
    spent, began = 0.0, 0.0
    for number, (_, record) in enumerate(executor.run(chosen)):
        if number == 0:  # all processes have started
            began = time.perf_counter()
        else:
            spent += record.wall_time
    return (time.perf_counter() - began - spent) / (count - 1)


def dask_worker_memory() -> float:
    """Of a Dask worker beside the process of its episodes [MB]."""
    with connection.started_here(1) as client:
        assert len(list(Cluster(lambda: nullcontext(client)).run(every()[:1]))) == 1
        (pid,) = client.run(os.getpid).values()
        return megabytes(psutil.Process(pid).memory_info().rss)


def held_each(count: int = 200_000) -> float:
    """Bytes that the command keeps of an episode: what it is, and what became of it."""
    before = psutil.Process().memory_info().rss
    base = Episode(catalogue.find_scenario("334"), CONTROLLERS[0], 0.5, 1)
    kept = [(replace(base, seed=seed), Outcome("ok")) for seed in range(count)]
    return (psutil.Process().memory_info().rss - before) / len(kept)


def report(tasks: int) -> Iterator[str]:
    """Lines of Markdown.

    Args:
        tasks: how many to send through the scheduler.
    """
    records = Store(RESULTS).read()
    held = held_each()
    wall = fmean(one.wall_time for one in records if one.wall_time)
    line = fmean(len(one.line()) for one in records)
    cost = Cost.measured()
    yield "| measured | |"
    yield "|---|---|"
    name = f"an episode, mean of the paper's four by {len(CONTROLLERS)} controllers"
    yield f"| {name} | {cost.processor:.2f} s of a core |"
    yield f"| an episode, wall time, mean of the {len(records)} in results/ | {wall:.2f} s |"
    yield f"| the process of an episode, at most | {cost.memory:.0f} MB |"
    yield f"| a Dask worker beside it | {dask_worker_memory():.0f} MB |"
    yield f"| a record on the disk | {line / 1024:.1f} KB |"
    yield f"| an episode in the command's memory | {held / 1024:.1f} KB |"
    yield f"| the cache, a scenario and seed | {cost.routes:.2f} MB |"

    local = min(overhead(LocalPool(1), 100) for _ in range(ROUNDS))
    connect = partial(connection.started_here, 1)
    dask = min(overhead(Cluster(connect), 100) for _ in range(ROUNDS))
    yield f"| an episode's way to a local process and back | {1000 * local:.1f} ms |"
    yield f"| the same with `--cluster local` | {1000 * dask:.1f} ms |"

    appended = max(appended_a_second(records[:2000]) for _ in range(ROUNDS))
    yield f"| records put on the disk | {appended:.0f} /s |"
    load = Load.measured(tasks, records[0])
    yield f"| {tasks} tasks that do nothing | {1 / load.wall:.0f} /s |"
    yield f"| a task in the scheduler | {1000 * load.scheduler:.2f} ms of a core |"
    yield f"| a task in the command | {1000 * load.command:.2f} ms of a core |"
    yield f"| tasks under way, at most | {load.most} |"
    yield f"| the scheduler's memory, at most | {load.scheduler_memory:.0f} MB |"
    yield f"| the command's memory, at most | {load.command_memory:.0f} MB |"
    yield ""
    limit = min(1 / load.wall, 1 / load.scheduler, 1 / load.command)
    yield f"| | {' | '.join(f'{size:.0e} episodes' for size in SIZES)} |"
    yield f"|---|{'---|' * len(SIZES)}"
    for name, cells in needs(wall, line, held, limit).items():
        yield f"| {name} | {' | '.join(cells)} |"
    yield ""
    yield f"{limit:.0f} tasks a second are what {limit * wall:.0f} cores end."


def needs(wall: float, line: float, held: float, limit: float) -> dict[str, list[str]]:
    """What suites of the sizes take.

    Args:
        wall: mean wall time of an episode [s].
        line: bytes of a record on the disk.
        held: bytes of an episode in the command.
        limit: tasks a second that one scheduler and command can do.
    """
    rates = {cores: min(cores / wall, limit) for cores in CORES}
    rows = {
        "core hours": wall / 3600,
        **{
            f"hours on {cores} cores, {rate:.0f} episodes/s": 1 / rate / 3600
            for cores, rate in rates.items()
        },
        "hours of scheduler and command": 1 / limit / 3600,
        "records on the disk [GB]": line / 1e9,
        "the command's memory [GB]": held / 1e9,
    }
    return {name: [_short(size * value) for size in SIZES] for name, value in rows.items()}


def _short(value: float) -> str:
    """Two digits at least."""
    return f"{value:,.0f}" if value >= 10 else f"{value:.2g}"


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--tasks", type=int, default=10**5, help="through the scheduler")
    for told in report(parser.parse_args().tasks):
        sys.stdout.write(told + "\n")
        sys.stdout.flush()

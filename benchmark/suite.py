"""Many runs: which episodes a study holds, and worker processes that run them."""

import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, as_completed
from typing import Any

from benchmark import demand, network, signals
from benchmark.episode import Episode, run
from benchmark.errors import ControllerError, RightOfWayError, StoreError
from benchmark.isolation.channel import Declared
from benchmark.isolation.limits import DEFAULT, Limits
from benchmark.isolation.remote import look
from benchmark.plugins import Plugin
from benchmark.record import Record
from benchmark.scenario import Scenario
from benchmark.workers import pool

TIME_LIMIT = 600.0  # s of wall time for one episode


def episodes(
    scenarios: Sequence[Scenario],
    controllers: Sequence[str],
    rates: Sequence[float] | None,
    seeds: Sequence[int] | None,
    *,
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
) -> list[Episode]:
    """All episodes of a study: every controller meets the same scenarios, rates and seeds.

    A controller that commands no vehicle runs once per scenario and seed, with no rate: what
    happens under it does not depend on who is an RV.

    Args:
        scenarios: what to run on.
        controllers: references, as ``benchmark.plugins.find`` reads them.
        rates: penetration rates; None takes each scenario's own.
        seeds: None takes each scenario's own.
        isolate: whether controllers run in processes of their own; None: those not installed do.
        limits: of isolated controllers.

    Raises:
        ControllerError: a controller is unknown, cannot be imported or has no such option, or two
            files have the same name.
    """
    looked = (look(one, isolate, limits) for one in controllers)
    found = {one.reference: one.kind for one in _told_apart(looked)}
    return [
        Episode(scenario, name, rate, seed, isolate, limits)
        for scenario in scenarios
        for name, kind in found.items()
        for rate in (
            (rates or scenario.evaluation.penetration_rates)
            if kind.needs_robot_vehicles
            else (None,)
        )
        for seed in seeds or range(1, scenario.evaluation.seeds + 1)
    ]


def _told_apart(found: Iterable[Plugin | Declared]) -> Iterator[Plugin | Declared]:
    """Controllers whose records can be told apart: those of two files are by the files' names."""
    seen: dict[str, str] = {}
    for plugin in found:
        if (other := seen.setdefault(plugin.label, plugin.reference)) != plugin.reference:
            raise ControllerError(
                f"{other} and {plugin.reference} would both be {plugin.label} in records; "
                "rename one file or class"
            )
        yield plugin


def prepare(chosen: Sequence[Episode]) -> None:
    """Build every network and demand once, before workers ask for them.

    Raises:
        RightOfWayError: a scenario cannot be built, or its signal endangers.
    """
    for scenario in {one.scenario.hash: one.scenario for one in chosen}.values():
        if scenario.signal is not None:
            signals.check(scenario, scenario.signal, network.build(scenario))
    for episode in {(one.scenario.hash, one.seed): one for one in chosen}.values():
        demand.build(episode.scenario, network.build(episode.scenario), episode.seed)


def run_all(
    chosen: Sequence[Episode],
    workers: int,
    time_limit: float = TIME_LIMIT,
    work: Callable[[Any], Record] = run,
) -> Iterator[Record]:
    """Run episodes in worker processes; yields each record as its episode ends.

    A worker that crashes or exceeds the time limit costs only its episode, whose record says so.

    Args:
        chosen: what to run.
        workers: processes side by side.
        time_limit: wall time for one episode [s].
        work: what a worker does with an episode.

    Raises:
        StoreError: a worker cannot write what it is to keep.
    """
    with (
        tempfile.TemporaryDirectory(prefix="rightofway-") as folder,
        pool(workers, _keep_files_in, folder) as started,
    ):
        futures: dict[Future[Record], Episode] = {
            started.schedule(work, args=(episode,), timeout=time_limit): episode
            for episode in chosen
        }
        try:
            for future in as_completed(futures):
                yield _record(future, futures[future], time_limit)
        except BaseException:  # the caller stops early, by Ctrl-C for one
            started.stop()  # type: ignore[no-untyped-call]
            raise


def _keep_files_in(folder: str) -> None:
    """A worker that is killed cannot clear its temporary files away; the parent does."""
    tempfile.tempdir = folder


def _record(future: Future[Record], episode: Episode, time_limit: float) -> Record:
    from pebble import ProcessExpired

    try:
        return future.result()
    except TimeoutError:
        return episode.record("timed out", reason=f"not done after {time_limit:g} s")
    except ProcessExpired as error:
        return episode.record("crashed", reason=f"the worker process died ({error.exitcode})")
    except StoreError:
        raise
    except RightOfWayError as error:
        return episode.record("failed", reason=str(error))
    except Exception as error:  # SUMO's own errors in mid-episode, for one
        return episode.record("crashed", reason=f"{type(error).__name__}: {error}")

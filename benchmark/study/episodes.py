"""Many runs: which episodes a study holds, and who runs them."""

from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import closing
from typing import Protocol

from benchmark.control.isolation.channel import Declared
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import look
from benchmark.control.plugins import Plugin
from benchmark.plumbing.errors import ControllerError
from benchmark.records.record import Record
from benchmark.scenario.scenario import Scenario
from benchmark.study.episode import Episode, run
from benchmark.study.outcome import TIME_LIMIT, Work
from benchmark.study.pool import LocalPool
from benchmark.sumo import demand, network, signals


class Executor(Protocol):
    """Runs episodes somewhere: in processes of this machine, or on a cluster.

    An episode that crashes or takes too long is tried once more (``benchmark.study.outcome``), and
    what befalls it is in its record: ``run`` raises only where nothing can be run any more.
    """

    def run(self, episodes: Sequence[Episode]) -> Generator[tuple[Episode, Record], None, None]:
        """Yield each episode with its record as it ends, starting them in the order given.

        Closing the generator stops at once, in the middle of episodes.
        """
        ...

    def drain(self) -> None:
        """Start no more episodes; ``run`` ends with those under way.

        May be called from a signal's handler.
        """
        ...


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
        controllers: references, as ``benchmark.control.plugins.find`` reads them.
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
    """Build every network and one demand on it, so that what cannot be built is refused at once.

    The demands of other seeds are built by the workers that need them.

    Raises:
        RightOfWayError: a scenario cannot be built, or its signal endangers.
    """
    for scenario in {one.scenario.hash: one.scenario for one in chosen}.values():
        if scenario.signal is not None:
            signals.check(scenario, scenario.signal, network.build(scenario))
    for episode in {one.scenario.hash: one for one in chosen}.values():
        demand.build(episode.scenario, network.build(episode.scenario), episode.seed)


def run_all(
    chosen: Sequence[Episode],
    workers: int,
    time_limit: float = TIME_LIMIT,
    work: Work = run,
) -> Iterator[Record]:
    """Run episodes in worker processes here; yields each record as its episode ends.

    Args:
        chosen: what to run.
        workers: processes side by side.
        time_limit: wall time for one try at an episode [s].
        work: what a worker does with an episode.

    Raises:
        StoreError: a worker cannot write what it is to keep.
    """
    with closing(LocalPool(workers, time_limit, work).run(chosen)) as running:
        for _, record in running:
            yield record

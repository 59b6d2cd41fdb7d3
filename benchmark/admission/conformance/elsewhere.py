"""Episodes in processes of their own: a controller that crashes or hangs there costs only them."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass

from benchmark.admission.conformance import reach
from benchmark.admission.conformance.watching import Commands, watch_episode
from benchmark.control import plugins
from benchmark.control.guard import ControllerFailedError
from benchmark.plumbing.errors import RightOfWayError
from benchmark.plumbing.processes import pool
from benchmark.scenario.scenario import Scenario

TIME_LIMIT = 60.0  # s of wall time for one episode
HASH_SEEDS = ("1", "2")  # Python orders sets of texts by it; the one that is not this process's


@dataclass(frozen=True)
class Task:
    """An episode to be run."""

    controller: str  # its reference
    scenario: Scenario
    rate: float | None
    seed: int


@dataclass(frozen=True)
class Trial:
    """What became of it."""

    failure: str | None = None
    hangs: bool = False  # whether it did not end in time
    skipped: str | None = None
    commands: Sequence[Sequence[str]] = ()  # as text: by junction, by step
    refusals: Sequence[str] = ()
    reaches: Sequence[str] = ()  # beyond the contract, as ``reach`` words it


def run_elsewhere(tasks: Sequence[Task]) -> list[Trial]:
    """Run episodes under a hash seed other than this process's.

    Raises:
        RightOfWayError: a scenario cannot be run.
    """
    found: list[Trial] = []
    with _other_hash_seed(), pool(min(2, len(tasks)), reach.begin) as started:
        futures = [started.schedule(run_one, args=(one,), timeout=TIME_LIMIT) for one in tasks]
        try:
            for future in futures:
                found.append(_trial(future))
                if found[-1].hangs:  # and so would those after it
                    started.stop()  # type: ignore[no-untyped-call]
                    break
        except BaseException:  # Ctrl-C, for one
            started.stop()  # type: ignore[no-untyped-call]
            raise
    return [*found, *[Trial(skipped="an episode before it did not end")] * len(futures)][
        : len(futures)
    ]


@contextmanager
def _other_hash_seed() -> Iterator[None]:
    before = os.environ.get("PYTHONHASHSEED")
    os.environ["PYTHONHASHSEED"] = next(one for one in HASH_SEEDS if one != before)
    try:
        yield
    finally:
        del os.environ["PYTHONHASHSEED"]
        if before is not None:
            os.environ["PYTHONHASHSEED"] = before


def _trial(future: "Future[Trial]") -> Trial:
    from pebble import ProcessExpired

    try:
        return future.result()
    except TimeoutError:
        late = f"the episode was not done after {TIME_LIMIT:g} s; do reset and act always return?"
        return Trial(late, hangs=True)
    except ProcessExpired as error:
        return Trial(f"its process died ({error.exitcode})")
    except RightOfWayError:
        raise
    except Exception as error:  # SUMO's own errors in mid-episode, for one
        return Trial(f"{type(error).__name__}: {error}")


def run_one(task: Task) -> Trial:
    """Run an episode in this process."""
    try:
        found = watch_episode(
            plugins.find_controller(task.controller), task.scenario, task.rate, task.seed
        )
    except ControllerFailedError as fault:
        return Trial(str(fault), reaches=tuple(reach.found))
    return Trial(
        skipped=found.skipped,
        commands=[[in_words(one) for one in track.commands] for track in found.tracks],
        refusals=found.refusals,
        reaches=tuple(reach.found),
    )


def in_words(commands: Commands) -> str:
    """The commands of a step as text that is equal where they are, in whatever order."""
    return ", ".join(
        f"{target}: {command!r}" for target, command in sorted(commands.items(), key=repr)
    )

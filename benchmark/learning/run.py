"""What every trainer needs while it runs: its episodes, a bar of progress, a way to be stopped."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from benchmark.control.training import FIRST_TRAINING_SEED, VALIDATION_SEEDS
from benchmark.learning.settings import TrainingTraffic, Validation
from benchmark.plumbing.interrupts import Interrupts
from benchmark.scenario.scenario import Scenario

if TYPE_CHECKING:
    import numpy as np
    from rich import progress


class Start(NamedTuple):
    """Which episode is to be played."""

    scenario: Scenario
    rate: float
    seed: int


def training_episodes(
    traffic: TrainingTraffic, scenarios: Sequence[Scenario], random: "np.random.Generator"
) -> Iterator[Start]:
    """A round's episodes: the scenarios by turns, rate, demand and seed drawn for each.

    Args:
        traffic: the settings.
        scenarios: as they are; their duration and demand are replaced.
        random: of the round.
    """
    for index in range(traffic.episodes):
        scenario = scenarios[index % len(scenarios)]
        evaluation = scenario.evaluation.model_copy(
            update={"duration": traffic.duration, "warm_up": 0.0}
        )
        scenario = scenario.with_demand(float(random.choice(traffic.demand)))
        yield Start(
            scenario.with_evaluation(evaluation),
            rate=float(random.choice(traffic.rates)),
            seed=FIRST_TRAINING_SEED + int(random.integers(traffic.seeds)),
        )


def validation_episodes(validation: Validation, scenarios: Sequence[Scenario]) -> Iterator[Start]:
    """The episodes of a validation, each scenario at full length."""
    for scenario in scenarios:
        for rate in validation.rates:
            for seed in VALIDATION_SEEDS[: validation.seeds]:
                yield Start(scenario, rate, seed)


@contextmanager
def bar(things: str) -> "Iterator[progress.Progress]":
    """A bar of progress.

    Args:
        things: what is counted, in the plural.
    """
    from rich import progress
    from rich.console import Console

    columns = (
        progress.TextColumn("{task.completed:,}/{task.total:,} " + things),
        progress.BarColumn(),
        progress.TimeElapsedColumn(),
        progress.TextColumn("left"),
        progress.TimeRemainingColumn(),
        progress.TextColumn("{task.description}"),
    )
    with progress.Progress(*columns, console=Console(stderr=True)) as display:
        yield display


def interrupts(notify: Callable[[str], None]) -> Interrupts:
    """Lets the round end after the first Ctrl-C, and says so."""
    return Interrupts(
        lambda: notify("stopping after this round; Ctrl-C again stops at once and loses it")
    )

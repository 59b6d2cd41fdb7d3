"""How long episodes will take, roughly, so that the slowest can start first."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from benchmark.control.isolation.remote import declaration_of
from benchmark.scenario.scenario import Scenario
from benchmark.study.episode import Episode

if TYPE_CHECKING:
    import polars

SIGNALS, ROBOTS = 0.7e-3, 1.2e-3  # s a vehicle where nothing jams
JAMS = 0.25  # few RVs regulate little, and a step of a jam costs ten others
FEWEST = 0.05  # the rate that stands for none
Key = tuple[object, ...]


def estimates(chosen: Sequence[Episode], table: "polars.DataFrame | None" = None) -> list[float]:
    """The wall time that each episode will take [s].

    As long as those of the records did that share scenario, controller and rate, else scenario and
    controller; without any, a guess from vehicles, rules and rate.

    Args:
        chosen: what is to be run.
        table: of earlier runs, as ``benchmark.records.table`` makes it.
    """
    means = _means(table)
    guess = _Guess()

    def seconds(episode: Episode) -> float:
        _, scenario_hash, controller, rate, _ = episode.key
        closest = means.get((scenario_hash, controller, rate))
        return closest or means.get((scenario_hash, controller)) or guess.of(episode)

    return [seconds(episode) for episode in chosen]


def slowest_first(chosen: Sequence[Episode], times: Sequence[float]) -> list[Episode]:
    """Episodes in the order that leaves the fewest workers idle at the end."""
    order = sorted(range(len(chosen)), key=times.__getitem__, reverse=True)
    return [chosen[index] for index in order]


def _means(table: "polars.DataFrame | None") -> dict[Key, float]:
    if table is None:
        return {}
    from polars import col

    timed = table.filter(col("wall_time") > 0).unique("record")  # some have several junctions
    means: dict[Key, float] = {}
    for keys in (("scenario_hash", "controller"), ("scenario_hash", "controller", "rate")):
        rows = timed.group_by(keys).agg(col("wall_time").mean()).iter_rows()
        means |= {tuple(key): mean for *key, mean in rows}
    return means


class _Guess:
    """How long episodes take that never ran; scenarios and controllers are looked at once."""

    def __init__(self) -> None:
        self._vehicles: dict[str, float] = {}
        self._signals: dict[str, bool] = {}

    def of(self, episode: Episode) -> float:
        """The wall time [s]."""
        scenario, controller = episode.scenario, episode.controller
        if scenario.hash not in self._vehicles:
            self._vehicles[scenario.hash] = _vehicles(scenario)
        if controller not in self._signals:
            declaration = declaration_of(controller, episode.isolate, episode.limits)
            self._signals[controller] = declaration.rules != "robot vehicles"
        jams = 1 + JAMS / max(episode.rate or 0.0, FEWEST)
        pace = SIGNALS if self._signals[controller] else ROBOTS * jams
        return self._vehicles[scenario.hash] * pace


def _vehicles(scenario: Scenario) -> float:
    """How many vehicles the demand holds before the episode ends."""
    end = scenario.evaluation.duration
    return sum(
        period.total * max(0.0, min(period.end, end) - period.begin) / 3600
        for period in scenario.demand
    )

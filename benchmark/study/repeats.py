"""Which episodes repeat those of a reference, and which scenarios are no longer the same."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from benchmark.control.isolation.remote import look
from benchmark.plumbing.errors import ControllerError
from benchmark.records.record import Record
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario, load
from benchmark.study.episode import Episode


@dataclass(frozen=True)
class Rerun:
    """What to run."""

    episodes: list[Episode]
    incomparable: dict[tuple[str, str], str] = field(default_factory=dict)
    """Scenarios by name and hash that cannot be run again as they were, and why."""


def plan(records: Iterable[Record], given: Sequence[Scenario]) -> Rerun:
    """The episodes of records once more.

    A scenario is found by its hash, whatever its name is now, among the given and the shipped.

    Args:
        records: of the episodes to be repeated.
        given: the user's scenarios.

    Raises:
        ControllerError: a controller is not installed any more, or lacks an option.
    """
    once = {record.episode: record for record in records}
    for controller in dict.fromkeys(record.controller for record in once.values()):
        _require(controller)
    known = [*given, *map(load, catalogue.shipped().values())]
    wanted = dict.fromkeys((one.scenario, one.scenario_hash) for one in once.values())
    found = {key: _find(*key, known) for key in wanted}
    episodes = [
        Episode(scenario, one.controller, one.rate, one.seed)
        for one in once.values()
        if isinstance(scenario := found[one.scenario, one.scenario_hash], Scenario)
    ]
    return Rerun(episodes, {key: one for key, one in found.items() if isinstance(one, str)})


def _require(controller: str) -> None:
    try:
        look(controller)
    except ControllerError as error:
        raise ControllerError(
            f"the reference has episodes of {controller}, but {error}\ninstall it, compare others "
            "with --controller, or make the reference anew with `rightofway reference update`"
        ) from error


def _find(name: str, scenario_hash: str, known: Sequence[Scenario]) -> Scenario | str:
    """The scenario with that hash, or why there is none."""
    candidates = [*known, *_at_demand(name, known)]
    for scenario in candidates:
        if scenario.hash == scenario_hash:
            return scenario
    if changed := next((one for one in candidates if one.name == name), None):
        return f"the scenario is {changed.hash[:8]}, was {scenario_hash[:8]}"
    return "no scenario of that name or content; name its file with --scenario or --suite"


def _at_demand(name: str, known: Sequence[Scenario]) -> list[Scenario]:
    """Scenarios at a demand of their own, where the name tells one, as in ``334@700``."""
    base, _, total = name.rpartition("@")
    try:
        return [one.at_demand(float(total)) for one in known if one.name == base]
    except (ValueError, ArithmeticError):  # no number, or no demand
        return []

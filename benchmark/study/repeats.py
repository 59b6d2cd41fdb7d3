"""Which episodes repeat those of a reference, and which scenarios are no longer the same."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from benchmark.control.isolation.remote import declaration_of
from benchmark.plumbing.errors import ControllerError
from benchmark.records.record import Record
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario, load_scenario
from benchmark.study.episode import Episode


@dataclass(frozen=True)
class Repeats:
    """What to run."""

    episodes: list[Episode]
    incomparable: dict[tuple[str, str], str] = field(default_factory=dict)
    """Scenarios by name and hash that cannot be run again as they were, and why."""


def repeats_of(records: Iterable[Record], given: Sequence[Scenario]) -> Repeats:
    """The episodes of records once more.

    A scenario is found by its hash, whatever its name is now, among the given and the shipped.

    Args:
        records: of the episodes to be repeated.
        given: the user's scenarios.

    Raises:
        ControllerError: a controller is not installed any more, or lacks an option.
    """
    newest = {record.episode: record for record in records}.values()
    for controller in dict.fromkeys(record.controller for record in newest):
        _require(controller)
    known = [*given, *map(load_scenario, catalogue.shipped_scenarios().values())]
    repeats = Repeats([])
    scenarios: dict[tuple[str, str], Scenario | str] = {}
    for record in newest:
        key = record.scenario, record.scenario_hash
        if key not in scenarios:
            scenarios[key] = _scenario(*key, known)
        if isinstance(scenario := scenarios[key], Scenario):
            episode = Episode(scenario, record.controller, record.rate, record.seed)
            repeats.episodes.append(episode)
        else:
            repeats.incomparable[key] = scenario
    return repeats


def _require(controller: str) -> None:
    try:
        declaration_of(controller)
    except ControllerError as error:
        raise ControllerError(
            f"the reference has episodes of {controller}, but {error}\ninstall it, compare others "
            "with --controller, or make the reference anew with `rightofway reference update`"
        ) from error


def _scenario(name: str, scenario_hash: str, known: Sequence[Scenario]) -> Scenario | str:
    """The scenario with that hash, or why there is none."""
    candidates = [*known, *_at_demand(name, known)]
    for scenario in candidates:
        if scenario.hash == scenario_hash:
            return scenario
    for scenario in candidates:
        if scenario.name == name:
            return f"the scenario is {scenario.hash[:8]}, was {scenario_hash[:8]}"
    return "no scenario of that name or content; name its file with --scenario or --suite"


def _at_demand(name: str, known: Sequence[Scenario]) -> list[Scenario]:
    """Scenarios at a demand of their own, where the name tells one, as in ``334@700``."""
    base, _, total = name.rpartition("@")
    try:
        return [scenario.at_demand(float(total)) for scenario in known if scenario.name == base]
    except (ValueError, ArithmeticError):  # no number, or no demand
        return []

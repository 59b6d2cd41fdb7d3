"""One episode in one line: what ``benchmark.run`` is."""

from pathlib import Path

from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import declaration_of
from benchmark.plumbing.errors import UsageError
from benchmark.records.record import Record
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario
from benchmark.study import episode
from benchmark.study.episode import Episode


def run(
    scenario: Scenario | str | Path,
    controller: str,
    rate: float | None = None,
    seed: int = 1,
    *,
    isolate: bool | None = None,
    limits: Limits = DEFAULT,
) -> Record:
    """Run one episode here and give its record.

    Args:
        scenario: a scenario, or its file or shipped name, such as ``"334"``.
        controller: a name, ``file.py:Class`` or ``package.module:Class``, with options or without.
        rate: penetration rate from 0 to 1; None for a controller that commands no vehicle.
        seed: of demand, drivers, RVs and the controller.
        isolate: whether the controller runs in a process of its own; None: if it is not installed.
        limits: of an isolated controller.

    Returns:
        The record; where the controller fails, its status and reason say so.

    Raises:
        RightOfWayError: scenario or controller are not there or cannot be run, or the rate is
            missing or none.
    """
    if not isinstance(scenario, Scenario):
        scenario = catalogue.find_scenario(str(scenario))
    declaration = declaration_of(controller, isolate, limits)
    if not declaration.needs_robot_vehicles:
        rate = None
    elif rate is None:
        raise UsageError(f"{declaration.label} commands RVs: say at which rate, as in rate=0.6")
    elif not 0 <= rate <= 1:
        raise UsageError(f"rate = {rate:g}: expected a share from 0 to 1")
    return episode.run_episode(
        Episode(scenario, declaration.reference, rate, seed, isolate, limits)
    )

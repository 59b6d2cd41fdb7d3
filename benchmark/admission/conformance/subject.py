"""The controller under test, with the episodes that several checks look at, each run once."""

from collections.abc import Mapping, Sequence
from functools import cached_property

from benchmark.admission.conformance import elsewhere
from benchmark.admission.conformance.elsewhere import Task, Trial
from benchmark.admission.conformance.watching import Track, Watched, watch_episode
from benchmark.control import plugins
from benchmark.control.controller import Controller
from benchmark.control.plugins import Plugin
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import network

SEED = 1001  # a validation seed: nothing is to be learnt from seeds that evaluate
MIDDLE = 0.5  # the penetration rate of most checks, where the controller is made for it


class Subject:
    """A controller and the scenarios that it is checked on.

    Args:
        controller: a reference, or a class that can be imported.
        scenarios: where.
    """

    def __init__(self, controller: str | type[Controller], scenarios: Sequence[Scenario]) -> None:
        if isinstance(controller, type):
            controller = f"{controller.__module__}:{controller.__qualname__}"
        self._controller, self.scenarios = controller, scenarios
        self._live: dict[str, Watched] = {}  # by the scenario's hash, as outcomes are

    @cached_property
    def plugin(self) -> Plugin:
        """The controller.

        Raises:
            ControllerError: as ``benchmark.control.plugins.find_controller``.
        """
        return plugins.find_controller(self._controller)

    @property
    def rate(self) -> float | None:
        """The penetration rate of most checks."""
        least, greatest = self.plugin.kind.rates
        return min(max(MIDDLE, least), greatest) if self._commands_vehicles else None

    @property
    def rates(self) -> list[float | None]:
        """The least, a middle and the greatest penetration rate that it is made for."""
        if not self._commands_vehicles:
            return [None]
        least, greatest = self.plugin.kind.rates
        return list(dict.fromkeys([float(least), self.rate, float(greatest)]))

    @property
    def _commands_vehicles(self) -> bool:
        return self.plugin.kind.needs_robot_vehicles

    def unmet(self, scenario: Scenario) -> str | None:
        """What it declares to need and the scenario lacks."""
        return self.plugin.declaration.unmet(
            network.build_network(scenario).intersections, self.rate
        )

    def skipped(self, scenario: Scenario) -> str | None:
        """Why it is not run on a scenario; None if it is, whatever comes of it."""
        outcomes = self.elsewhere(scenario).values()
        if any(one.failure for one in outcomes):
            return None
        return self.unmet(scenario) or next((one.skipped for one in outcomes if one.skipped), None)

    def ran(self, scenario: Scenario) -> bool:
        """Whether it got through all episodes of a scenario."""
        outcomes = self.elsewhere(scenario).values()
        return bool(outcomes) and not any(one.failure or one.skipped for one in outcomes)

    def elsewhere(self, scenario: Scenario) -> Mapping[float | None, Trial]:
        """What became of episodes in processes of their own, by rate; none where it lacks needs."""
        return self._outcomes.get(scenario.hash, {})

    @cached_property
    def _outcomes(self) -> dict[str, dict[float | None, Trial]]:
        tasks = [
            Task(self.plugin.reference, scenario, rate, SEED)
            for scenario in self.scenarios
            if self.unmet(scenario) is None
            for rate in self.rates
        ]
        found: dict[str, dict[float | None, Trial]] = {}
        for task, outcome in zip(
            tasks, elsewhere.run_elsewhere(tasks) if tasks else [], strict=True
        ):
            found.setdefault(task.scenario.hash, {})[task.rate] = outcome
        return found

    def live(self, scenario: Scenario) -> Watched:
        """An episode in this process, of a scenario on which those elsewhere went well."""
        if scenario.hash not in self._live:
            self._live[scenario.hash] = watch_episode(self.plugin, scenario, self.rate, SEED)
        return self._live[scenario.hash]

    def other(self, scenario: Scenario) -> Sequence[Track]:
        """The tracks of another episode: on another scenario, if it runs on one."""
        index = list(self.scenarios).index(scenario)
        for one in [*self.scenarios[index + 1 :], *self.scenarios[:index]]:
            if self.ran(one):
                return self.live(one).tracks
        return watch_episode(self.plugin, scenario, self.rate, SEED + 1).tracks

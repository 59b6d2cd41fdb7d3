"""The learning problem as a PettingZoo environment: every RV that decides is an agent."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from benchmark.control.training import FIRST_TRAINING_SEED
from benchmark.learning.observation import Layout, Numbers, size
from benchmark.learning.traffic import Moment, Reward, Traffic, checked
from benchmark.plumbing.errors import UsageError
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario
from benchmark.world.gridlock import GRIDLOCK_AFTER

Agent = str


class GoStopParallelEnv(ParallelEnv[Agent, Numbers, int]):  # type: ignore[misc]  # untyped base
    """RVs come into the decision zone, decide every second and leave into the intersection.

    A step with nobody there is passed over, so there is always an agent until the episode is over.
    An agent terminates when it enters the intersection and is truncated when the episode ends; its
    info then says under ``gridlocked`` whether that was early. ``docs/learning.md`` describes
    observation, action and reward.

    Args:
        scenario: a scenario, or a reference to one, such as ``334`` or a file.
        rate: the penetration rate.
        seed: of the first episode; each reset without a seed takes the next.
        layout: of the observation.
        reward: what decisions earn; default: as published.
        gridlock_after: time in which nobody enters after which the episode ends [s].

    Raises:
        ScenarioError: the reference leads nowhere, or to several scenarios.
    """

    metadata = {"name": "rightofway_go_stop_v0", "render_modes": []}  # noqa: RUF012
    render_mode = None

    def __init__(
        self,
        scenario: Scenario | str = "334",
        rate: float = 0.5,
        seed: int = FIRST_TRAINING_SEED,
        *,
        layout: Layout = "paper",
        reward: Reward | None = None,
        gridlock_after: float = GRIDLOCK_AFTER,
    ) -> None:
        self.scenario = catalogue.find_scenario(scenario) if isinstance(scenario, str) else scenario
        self.rate, self._next_seed, self._layout = rate, seed, layout
        self._reward, self._gridlock_after = reward, gridlock_after
        self._traffic: Traffic | None = None
        self.agents: list[Agent] = []
        self.possible_agents: list[Agent] = []
        self._observation_space = spaces.Box(0.0, 1.0, (size(layout),), np.float32)
        self._action_space = spaces.Discrete(2)

    def observation_space(self, agent: Agent) -> spaces.Box:
        """The same for every agent."""
        return self._observation_space

    def action_space(self, agent: Agent) -> spaces.Discrete:
        """0 is Stop, 1 is Go, for every agent."""
        return self._action_space

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[Agent, Numbers], dict[Agent, dict[str, Any]]]:
        """Start an episode; it begins when the first RV comes into the decision zone."""
        self.close()
        seed = self._next_seed if seed is None else seed
        self._next_seed = seed + 1
        traffic = Traffic(
            self.scenario,
            self.rate,
            seed,
            layout=self._layout,
            reward=self._reward,
            gridlock_after=self._gridlock_after,
        )
        self._traffic = traffic.__enter__()
        self.possible_agents = list(traffic.deciders)
        moment = self._pass_empty(traffic.first())
        if moment.over or moment.gridlocked:
            self.close()  # nobody has come to decide
            return {}, {}
        self.agents = [ego.id for ego in moment.egos]
        observations = dict(zip(self.agents, moment.observations, strict=True))
        return observations, self._infos(moment, self.agents)

    def _pass_empty(self, moment: Moment) -> Moment:
        assert self._traffic is not None
        while not (moment.egos or moment.over or moment.gridlocked):
            moment = self._traffic.step({})
        return moment

    def step(
        self, actions: Mapping[Agent, int]
    ) -> tuple[
        dict[Agent, Numbers],
        dict[Agent, float],
        dict[Agent, bool],
        dict[Agent, bool],
        dict[Agent, dict[str, Any]],
    ]:
        """Let the agents act for one step.

        Raises:
            UsageError: no episode runs, an agent has no action, or an action is none.
        """
        if self._traffic is None:
            raise UsageError("no episode is under way; call reset first")
        moment = self._traffic.step(self._checked(actions))
        followed = moment.followed
        moment = self._pass_empty(moment)
        ended = moment.over or moment.gridlocked
        seen = dict(zip((ego.id for ego in moment.egos), moment.observations, strict=True))
        nothing = np.zeros(size(self._layout), dtype=np.float32)
        agents = list(followed if ended else dict.fromkeys([*followed, *seen]))
        terminations = {name: name in followed and followed[name].left for name in agents}
        truncations = {name: ended and not terminations[name] for name in agents}
        infos = self._infos(moment, agents)
        if ended:
            self.close()
        self.agents = [name for name in seen if not ended]
        return (
            {name: seen.get(name, nothing) for name in agents},
            {name: followed[name].reward if name in followed else 0.0 for name in agents},
            terminations,
            truncations,
            infos,
        )

    def _checked(self, actions: Mapping[Agent, int]) -> dict[Agent, int]:
        if set(actions) != set(self.agents):
            odd = sorted(set(actions) ^ set(self.agents))
            raise UsageError(f"{odd[0]}: expected one action for each of the agents {self.agents}")
        return {name: checked(action, name) for name, action in actions.items()}

    def _infos(self, moment: Moment, agents: list[Agent]) -> dict[Agent, dict[str, Any]]:
        return {name: {"time": moment.time, "gridlocked": moment.gridlocked} for name in agents}

    def close(self) -> None:
        """End the simulation."""
        if self._traffic is not None:
            self._traffic.__exit__(None, None, None)
            self._traffic = None
        self.agents = []


def parallel_env(**arguments: Any) -> GoStopParallelEnv:
    """The environment, by PettingZoo's usual name."""
    return GoStopParallelEnv(**arguments)

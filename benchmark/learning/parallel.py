"""The learning problem as a PettingZoo environment: every RV that decides is an agent."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from benchmark.control.training import FIRST_TRAINING_SEED, Training
from benchmark.learning.observation import Layout, Numbers
from benchmark.learning.sequence import TrafficSequence
from benchmark.learning.traffic import Moment, Reward, checked
from benchmark.plumbing.errors import UsageError
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
        seed: of the first episode; each reset without a seed takes the next. A seed that is not
            for training, such as 1, stands for one that is: ``seeds.training_seed``.
        layout: of the observation.
        reward: what decisions earn; default: as published.
        gridlock_after: time in which nobody enters after which the episode ends [s].
        any_seed: play seeds as they are given, also those of evaluation and validation.

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
        any_seed: bool = False,
    ) -> None:
        self._traffics = TrafficSequence(
            scenario,
            rate,
            seed,
            any_seed=any_seed,
            layout=layout,
            reward=reward,
            gridlock_after=gridlock_after,
        )
        self.agents: list[Agent] = []
        self.possible_agents: list[Agent] = []
        self._observation_space = spaces.Box(0.0, 1.0, (self._traffics.observation_size,))
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
        """Start an episode; it begins when the first RV comes into the decision zone.

        Args:
            seed: of its traffic.
            options: ``rate``, the penetration rate from now on.

        Raises:
            UsageError: there is no such seed, rate or option.
        """
        self._traffics.prepare(seed, options)
        self.close()
        with self._traffics.closed_on_failure():
            moment = self._pass_empty(self._traffics.open())
        assert self._traffics.traffic is not None
        self.possible_agents = list(self._traffics.traffic.deciders)
        if moment.over or moment.gridlocked:
            self.close()  # nobody has come to decide
            return {}, {}
        self.agents = [ego.id for ego in moment.egos]
        observations = dict(zip(self.agents, moment.observations, strict=True))
        return observations, self._infos(moment, self.agents)

    def _pass_empty(self, moment: Moment) -> Moment:
        while not (moment.egos or moment.over or moment.gridlocked):
            moment = self._traffics.step({})
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
        if self._traffics.traffic is None:
            raise UsageError("no episode is under way; call reset first")
        chosen = self._checked(actions)
        with self._traffics.closed_on_failure():
            moment = self._traffics.step(chosen)
            followed = moment.followed
            moment = self._pass_empty(moment)
        ended = moment.over or moment.gridlocked
        seen = dict(zip((ego.id for ego in moment.egos), moment.observations, strict=True))
        nothing = np.zeros(self._traffics.observation_size, dtype=np.float32)
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
        info = {"time": moment.time, "gridlocked": moment.gridlocked, "seed": self._traffics.seed}
        return {name: dict(info) for name in agents}

    @property
    def scenario(self) -> Scenario:
        """Where it happens."""
        return self._traffics.scenario

    @property
    def rate(self) -> float:
        """The penetration rate."""
        return self._traffics.rate

    @property
    def seeds_met(self) -> list[int]:
        """Seeds of the traffics played so far, ascending."""
        return self._traffics.seeds_met

    @property
    def trained_on(self) -> tuple[Training, ...]:
        """The traffic played so far, as a controller declares it."""
        return self._traffics.trained_on

    def close(self) -> None:
        """End the simulation."""
        self._traffics.close()
        self.agents = []


def parallel_env(**arguments: Any) -> GoStopParallelEnv:
    """The environment, by PettingZoo's usual name."""
    return GoStopParallelEnv(**arguments)

"""The learning problem as a Gymnasium environment: one RV learns, the others follow a script."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from benchmark.control.training import FIRST_TRAINING_SEED
from benchmark.learning.observation import Layout, Numbers, size
from benchmark.learning.rollout import Policy
from benchmark.learning.traffic import GO, Moment, Reward, Traffic, checked
from benchmark.plumbing.errors import UsageError
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario
from benchmark.world.gridlock import GRIDLOCK_AFTER

ID = "RightOfWay/GoStop-v0"
"""The environment's id: ``gymnasium.make(f"benchmark.learning.single:{ID}")``."""

PATIENCE = 10  # traffics in a row in which no RV comes to decide, before reset gives up


class GoStopEnv(gymnasium.Env[Numbers, np.int64]):
    """One RV from its first decision until it enters the intersection.

    ``reset`` without a seed goes on to the next RV of the same traffic, and to the next traffic
    where that has ended. ``docs/learning.md`` describes observation, action and reward.

    Args:
        scenario: a scenario, or a reference to one, such as ``334`` or a file.
        rate: the penetration rate.
        seed: of the first traffic; each further one takes the next.
        layout: of the observation.
        reward: what decisions earn; default: as published.
        gridlock_after: time in which nobody enters after which the traffic ends [s].
        others: what the other RVs do; default: they all say Go.

    Raises:
        ScenarioError: the reference leads nowhere, or to several scenarios.
    """

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        scenario: Scenario | str = "334",
        rate: float = 0.5,
        seed: int = FIRST_TRAINING_SEED,
        *,
        layout: Layout = "paper",
        reward: Reward | None = None,
        gridlock_after: float = GRIDLOCK_AFTER,
        others: Policy | None = None,
    ) -> None:
        self.scenario = catalogue.find_scenario(scenario) if isinstance(scenario, str) else scenario
        self.rate, self._next_seed, self._layout = rate, seed, layout
        self._reward, self._gridlock_after, self._others = reward, gridlock_after, others
        self.observation_space = spaces.Box(0.0, 1.0, (size(layout),), np.float32)
        self.action_space = spaces.Discrete(2)
        self._traffic: Traffic | None = None
        self._past: set[str] = set()  # RVs that were the ego
        self._ego: str | None = None

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Go on to the next RV; with a seed, to the first of that traffic.

        Raises:
            UsageError: no RV came to decide in several traffics in a row.
        """
        super().reset(seed=seed)
        if seed is not None:
            self.close()
            self._next_seed = seed
        for _ in range(1 + PATIENCE):
            moment = self._moment if self._traffic is not None else self._start()
            while not (moment.over or moment.gridlocked):
                if fresh := [ego.id for ego in moment.egos if ego.id not in self._past]:
                    self._ego = fresh[int(self._draws.integers(len(fresh)))]
                    self._past.add(self._ego)
                    return self._observation(moment), self._info(moment)
                moment = self._play(moment, {})
            self.close()
        raise UsageError(
            f"{self.scenario.name}: nobody decides at rate {self.rate:g} in {PATIENCE} traffics; "
            "expected more RVs, or a later gridlock_after"
        )

    def _start(self) -> Moment:
        traffic = Traffic(
            self.scenario,
            self.rate,
            self._next_seed,
            layout=self._layout,
            reward=self._reward,
            gridlock_after=self._gridlock_after,
        )
        self._traffic = traffic.__enter__()
        self._draws = np.random.default_rng(self._next_seed)  # which of several arrivals is it
        self._next_seed += 1
        self._past.clear()
        self._moment = traffic.first()
        return self._moment

    def step(self, action: np.int64 | int) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Let the ego act for one step.

        Raises:
            UsageError: no episode runs, or the action is none.
        """
        if self._traffic is None or self._ego is None:
            raise UsageError("no episode is under way; call reset first")
        moment = self._play(self._moment, {self._ego: checked(action, self._ego)})
        decision = moment.followed[self._ego]
        ended = moment.over or moment.gridlocked
        found = (
            self._observation(moment),
            decision.reward,
            decision.left,
            ended and not decision.left,
            self._info(moment),
        )
        if decision.left or ended:
            self._ego = None
        return found

    def _play(self, moment: Moment, own: Mapping[str, int]) -> Moment:
        """One step, the others by their script."""
        assert self._traffic is not None
        if self._others is None:
            actions = {ego.id: GO for ego in moment.egos}
        else:
            chosen = self._others(moment.observations) if moment.egos else ()
            actions = {ego.id: int(one) for ego, one in zip(moment.egos, chosen, strict=True)}
        self._moment = self._traffic.step({**actions, **own})
        return self._moment

    def _observation(self, moment: Moment) -> Numbers:
        names = [ego.id for ego in moment.egos]
        if self._ego in names:
            seen: Numbers = moment.observations[names.index(self._ego)]
            return seen
        return np.zeros(size(self._layout), dtype=np.float32)

    def _info(self, moment: Moment) -> dict[str, Any]:
        return {"vehicle": self._ego, "time": moment.time, "gridlocked": moment.gridlocked}

    def close(self) -> None:
        """End the simulation."""
        if self._traffic is not None:
            self._traffic.__exit__(None, None, None)
            self._traffic = None
        self._ego = None


if ID not in gymnasium.registry:
    gymnasium.register(ID, entry_point=f"{__name__}:GoStopEnv")

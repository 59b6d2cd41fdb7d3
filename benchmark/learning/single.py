"""The learning problem as a Gymnasium environment: one RV learns, the others follow a script."""

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from benchmark.control.training import FIRST_TRAINING_SEED, Training
from benchmark.learning.observation import Layout, Numbers
from benchmark.learning.rollout import Policy
from benchmark.learning.seeds import seed_from
from benchmark.learning.sequence import TrafficSequence
from benchmark.learning.traffic import GO, Moment, Reward, checked
from benchmark.plumbing.errors import UsageError
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
        seed: of the first traffic; each further one takes the next. A seed that is not for
            training, such as 1, stands for one that is: ``seeds.training_seed``.
        layout: of the observation.
        reward: what decisions earn; default: as published.
        gridlock_after: time in which nobody enters after which the traffic ends [s].
        others: what the other RVs do; default: they all say Go.
        any_seed: play seeds as they are given, also those of evaluation and validation.

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
        any_seed: bool = False,
    ) -> None:
        self._others = others
        self._traffics = TrafficSequence(
            scenario,
            rate,
            seed,
            any_seed=any_seed,
            layout=layout,
            reward=reward,
            gridlock_after=gridlock_after,
        )
        self.observation_space = spaces.Box(0.0, 1.0, (self._traffics.observation_size,))
        self.action_space = spaces.Discrete(2)
        self._past: set[str] = set()  # RVs that were the ego
        self._ego: str | None = None

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Go on to the next RV; with a seed or another rate, to the first of that traffic.

        Args:
            seed: of the traffic.
            options: ``rate``, the penetration rate from now on.

        Raises:
            UsageError: no RV came to decide in several traffics in a row, or there is no such
                seed, rate or option.
        """
        seed = None if seed is None else seed_from(seed)
        super().reset(seed=seed)
        self._traffics.prepare(seed, options)
        self._ego = None
        with self._traffics.closed_on_failure():
            return self._next_ego()

    def _next_ego(self) -> tuple[Numbers, dict[str, Any]]:
        for _ in range(1 + PATIENCE):
            moment = self._start() if self._traffics.traffic is None else self._moment
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
        self._moment = self._traffics.open()
        self._draws = np.random.default_rng(self._traffics.seed)  # which of several arrivals is it
        self._past.clear()
        return self._moment

    def step(
        self, action: np.int64 | int | npt.NDArray[np.integer]
    ) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Let the ego act for one step.

        Raises:
            UsageError: no episode runs, or the action is none.
        """
        if self._traffics.traffic is None or self._ego is None:
            raise UsageError("no episode is under way; call reset first")
        own = {self._ego: checked(action, self._ego)}
        with self._traffics.closed_on_failure():
            moment = self._play(self._moment, own)
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
        if self._others is None:
            actions = {ego.id: GO for ego in moment.egos}
        else:
            chosen = self._others(moment.observations) if moment.egos else ()
            actions = {ego.id: int(one) for ego, one in zip(moment.egos, chosen, strict=True)}
        self._moment = self._traffics.step({**actions, **own})
        return self._moment

    def _observation(self, moment: Moment) -> Numbers:
        names = [ego.id for ego in moment.egos]
        if self._ego in names:
            seen: Numbers = moment.observations[names.index(self._ego)]
            return seen
        return np.zeros(self._traffics.observation_size, dtype=np.float32)

    def _info(self, moment: Moment) -> dict[str, Any]:
        return {
            "vehicle": self._ego,
            "time": moment.time,
            "gridlocked": moment.gridlocked,
            "seed": self._traffics.seed,
        }

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
        self._ego = None


if ID not in gymnasium.registry:
    gymnasium.register(ID, entry_point=f"{__name__}:GoStopEnv")

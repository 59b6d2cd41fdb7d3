"""One RV as an environment of Gymnasium."""

from collections.abc import Callable

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

from benchmark.learning.single import ID, GoStopEnv
from benchmark.learning.traffic import GO, STOP
from benchmark.plumbing.errors import UsageError
from benchmark.world.gridlock import GridlockWatch


def test_the_single_environment_passes_the_checks_of_gymnasium_and_stable_baselines() -> None:
    env = gymnasium.make(f"benchmark.learning.single:{ID}", scenario="smoke/crossing", rate=0.6)
    try:
        check_env(env.unwrapped)
        env.close()
        check_env_for_sb3(env.unwrapped)
    finally:
        env.close()


def test_resets_without_a_seed_go_on_to_the_next_rv_of_the_same_traffic(
    single: Callable[..., GoStopEnv],
) -> None:
    env, again = single(), single()
    _, first = again.reset()
    again.close()
    times, egos = [], []
    for _ in range(8):
        _, info = env.reset()
        egos.append(info["vehicle"])
        times.append(info["time"])
        over = False
        while not over:
            *_, terminated, truncated, _ = env.step(np.int64(GO))
            over = terminated or truncated
    assert len(set(egos)) == len(egos)
    assert egos[0] == first["vehicle"]
    assert times == sorted(times)


def test_an_ego_that_stops_is_there_until_the_episode_ends(
    single: Callable[..., GoStopEnv],
) -> None:
    env = single(gridlock_after=1000.0)
    env.reset(seed=10_001)
    over, terminated, steps = False, False, 0
    while not over:
        _, _, terminated, over, info = env.step(STOP)
        steps += 1
    assert not terminated
    assert info["time"] == 120
    assert steps > 60


def test_the_others_follow_a_policy_of_ones_own(single: Callable[..., GoStopEnv]) -> None:
    env = single(others=lambda seen: np.full(len(seen), STOP), gridlock_after=30.0)
    env.reset(seed=10_001)
    over = terminated = False
    while not (over or terminated):
        _, _, terminated, over, _ = env.step(GO)
    first = env._past.copy()
    env.reset()
    assert env._past > first or len(env._past) == 1  # the next ego, or the next traffic


def test_a_rate_at_which_nobody_decides_is_refused(single: Callable[..., GoStopEnv]) -> None:
    with pytest.raises(UsageError, match="nobody decides at rate 0"):
        single(rate=0.0).reset()


def test_traffics_that_no_rv_comes_to_are_passed_over(single: Callable[..., GoStopEnv]) -> None:
    env = single(rate=0.05)
    for seed in range(10_001, 10_013):
        _, info = env.reset(seed=seed)
        assert info["vehicle"]


def test_traffics_that_gridlock_before_anybody_decides_are_refused(
    single: Callable[..., GoStopEnv], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(GridlockWatch, "gridlocked", property(lambda _: True))
    with pytest.raises(UsageError, match="a later gridlock_after"):
        single().reset()

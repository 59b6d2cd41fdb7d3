"""RVs as agents of a parallel environment of PettingZoo."""

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from factories.processes import PATIENCE
from pettingzoo.test import parallel_api_test

from benchmark.learning.parallel import GoStopParallelEnv
from benchmark.learning.single import GoStopEnv
from benchmark.learning.traffic import GO, STOP
from benchmark.plumbing.errors import ScenarioError, UsageError

Steps = list[tuple[Any, ...]]


def played(env: GoStopParallelEnv, action: int, seed: int | None = None) -> Steps:
    """Every step of an episode in which all agents do the same."""
    env.reset(seed=seed)
    steps: Steps = []
    while env.agents:
        steps.append(env.step(dict.fromkeys(env.agents, action)))
    return steps


# RVs of the demand that never reached the zone are possible agents which never were there.
@pytest.mark.filterwarnings("ignore:No agents present but not all possible_agents")
def test_the_parallel_environment_passes_pettingzoos_test(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    parallel_api_test(environment(), num_cycles=200)


def test_equal_seeds_give_equal_episodes_and_others_other_ones(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    env = environment()
    one, again, other = (played(env, GO, seed) for seed in (10_001, 10_001, 10_002))
    assert len(one) == len(again) > 30
    for (seen, *rest), (seen_again, *rest_again) in zip(one, again, strict=True):
        assert seen.keys() == seen_again.keys()
        assert all(np.array_equal(seen[name], seen_again[name]) for name in seen)
        assert rest == rest_again
    assert [step[1] for step in one] != [step[1] for step in other]


def test_resets_without_a_seed_go_through_the_seeds(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    env = environment(seed=10_001)
    rewards = [[step[1] for step in played(env, GO)] for _ in range(2)]
    explicit = [[step[1] for step in played(env, GO, seed)] for seed in (10_001, 10_002)]
    assert rewards == explicit


def test_agents_come_enter_and_never_come_back(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    env = environment()
    steps = played(env, GO)
    gone: set[str] = set()
    for seen, _, terminated, truncated, _ in steps:
        assert not gone & seen.keys()
        gone |= {name for name in seen if terminated[name] or truncated[name]}
        for name in seen:
            assert not (terminated[name] and seen[name].any())
    assert len(gone) > 5
    assert gone <= set(env.possible_agents)


def test_rvs_that_are_told_to_stop_never_enter(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    steps = played(environment(gridlock_after=1000.0), STOP)
    assert not any(any(terminated.values()) for _, _, terminated, _, _ in steps)
    *_, truncated, infos = steps[-1]
    assert all(truncated.values())
    assert not any(info["gridlocked"] for info in infos.values())
    assert next(iter(infos.values()))["time"] == 120


def test_an_episode_ends_early_when_nobody_has_entered_for_long(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    *_, last = played(environment(rate=1.0, gridlock_after=20.0), STOP)
    _, _, terminated, truncated, infos = last
    assert all(truncated.values())
    assert not any(terminated.values())
    assert all(info["gridlocked"] for info in infos.values())
    assert next(iter(infos.values()))["time"] < 60


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda actions: {**actions, "nobody": GO}, "nobody: expected one action for each"),
        (lambda actions: {}, "expected one action for each of the agents"),
        *(
            (
                lambda actions, bad=bad: dict.fromkeys(actions, bad),
                "expected 0 for Stop or 1 for Go",
            )
            for bad in (2, -1, 0.5, None, "go", [1], np.array([0, 1]))
        ),
    ],
)
def test_actions_that_make_no_sense_are_refused(
    change: Callable[[dict[str, int]], dict[str, int]],
    message: str,
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    env = environment()
    env.reset()
    with pytest.raises(UsageError, match=message):
        env.step(change(dict.fromkeys(env.agents, GO)))


def test_a_step_without_a_reset_is_refused(
    environment: Callable[..., GoStopParallelEnv], single: Callable[..., GoStopEnv]
) -> None:
    for env, action in ((environment(), {}), (single(), GO)):
        with pytest.raises(UsageError, match="call reset first"):
            env.step(action)  # type: ignore[arg-type]


def test_a_second_environment_in_one_process_is_refused_until_the_first_is_closed(
    environment: Callable[..., GoStopParallelEnv], single: Callable[..., GoStopEnv]
) -> None:
    one, other = environment(), single()
    one.reset()
    with pytest.raises(UsageError, match="one simulation per process; close the other first"):
        other.reset()
    one.close()
    other.reset()


@pytest.mark.parametrize(
    ("reference", "message"), [("smoke", "names 3 scenarios"), ("smoke/teh", "unknown scenario")]
)
def test_a_reference_that_leads_to_no_single_scenario_is_refused(
    reference: str, message: str
) -> None:
    for kind in (GoStopParallelEnv, GoStopEnv):
        with pytest.raises(ScenarioError, match=message):
            kind(reference)


def test_rewards_follow_from_what_is_seen(environment: Callable[..., GoStopParallelEnv]) -> None:
    own_waiting, was_held_back = 8, 124  # docs/learning.md
    env, random = environment(rate=1.0, layout="extended"), np.random.default_rng(1)
    before, _ = env.reset(seed=10_001)
    penalties = 0
    while env.agents:
        actions = {name: int(random.integers(2)) for name in env.agents}
        after, rewards, terminated, _, _ = env.step(actions)
        for name, action in actions.items():
            if not terminated[name]:
                sign = 1 if action == GO else -1
                expected = sign * before[name][own_waiting] - after[name][was_held_back]
                assert rewards[name] == pytest.approx(expected, abs=1e-6)
                penalties += int(after[name][was_held_back])
        before = after
    assert penalties > 5


def test_an_episode_that_nobody_comes_to_is_over_at_once(
    environment: Callable[..., GoStopParallelEnv],
) -> None:
    env = environment(rate=0.0)
    assert env.reset() == ({}, {})
    assert env.agents == []
    with pytest.raises(UsageError, match="call reset first"):
        env.step({})


@pytest.mark.parametrize("action", [STOP, GO])
def test_whoever_comes_as_the_episode_ends_is_no_agent(
    action: int, environment: Callable[..., GoStopParallelEnv]
) -> None:
    env = environment(rate=1.0, gridlock_after=15.0)
    for seed in range(10_001, 10_016):
        env.reset(seed=seed)
        while env.agents:
            acting = set(env.agents)
            seen, *_ = env.step(dict.fromkeys(env.agents, action))
        assert seen.keys() == acting


def test_the_package_itself_needs_no_training_extras() -> None:
    code = "import sys, benchmark.learning, benchmark.commands.app; print(*sys.modules)"
    line = [sys.executable, "-c", code]
    loaded = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE).stdout
    assert "benchmark.learning" in loaded.split()
    assert not {"gymnasium", "pettingzoo", "torch", "stable_baselines3"} & set(loaded.split())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rate": 7.0}, "rate 7: expected a share from 0 to 1"),
        ({"layout": "papre"}, 'unknown layout "papre"; expected one of paper, extended'),
    ],
)
def test_a_rate_or_layout_that_makes_no_sense_is_refused(
    arguments: dict[str, Any], message: str, environment: Callable[..., GoStopParallelEnv]
) -> None:
    with pytest.raises(UsageError, match=message):
        environment(**arguments).reset()

"""Training by libraries of others: Stable-Baselines3, and a loop over vector environments."""

import gymnasium
import pytest
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv, VectorEnv
from stable_baselines3 import PPO

from benchmark.control.training import Training
from benchmark.learning.seeds import TRAINING_SEEDS, joined
from benchmark.learning.single import ID, GoStopEnv


def by_id() -> GoStopEnv:
    env: GoStopEnv = gymnasium.make(  # type: ignore[assignment]
        f"benchmark.learning.single:{ID}", scenario="smoke/crossing", rate=0.7
    )
    return env


def test_ppo_with_a_seed_learns_from_traffic_of_training_alone() -> None:
    model = PPO("MlpPolicy", by_id(), n_steps=32, batch_size=32, n_epochs=1, seed=1, device="cpu")
    model.learn(32)
    env = model.get_env()
    assert env is not None
    (met,) = env.get_attr("seeds_met")
    assert met[0] == 10_001
    assert all(seed in TRAINING_SEEDS for seed in met)
    observation = env.reset()[0]
    action, _ = model.predict(observation, deterministic=True)
    assert action.shape == ()
    env.envs[0].unwrapped.step(action)  # type: ignore[attr-defined]
    env.close()


@pytest.mark.parametrize(("kind", "count"), [(SyncVectorEnv, 1), (AsyncVectorEnv, 2)])
def test_a_vector_of_environments_says_what_it_met(kind: type[VectorEnv], count: int) -> None:
    vector = kind([by_id] * count)  # type: ignore[call-arg]
    try:
        vector.reset(seed=1)
        for _ in range(3):
            *_, infos = vector.step(vector.action_space.sample())
        declared = joined(vector.get_attr("trained_on"))  # type: ignore[attr-defined]
    finally:
        vector.close()
    assert infos["seed"].tolist() == [10_001, 10_002][:count]
    assert declared == (Training(scenarios=("smoke/crossing",), first=10_001, last=10_000 + count),)

"""Learning the low level: trajectories, advantages, and runs that repeat and resume."""

import json
from collections.abc import Mapping
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import pytest
import tomli_w
import torch
from factories.scenarios import smoke
from factories.training import without_workers
from hypothesis import given
from hypothesis import strategies as st
from stable_baselines3.common.logger import Logger

from baselines.hierarchical import ppo, train
from baselines.hierarchical.local_observation import SIZE as SIZE_TUNED
from baselines.hierarchical.local_observation import Beside
from baselines.hierarchical.observation import SIZE
from baselines.hierarchical.policy import RIGHT, ActionNetwork, shapes
from baselines.hierarchical.reward import DrivingReward
from baselines.hierarchical.rollout import Exercise, play
from benchmark.learning import rounds
from benchmark.learning import weights as files
from benchmark.learning.observation import Numbers
from benchmark.learning.rollout import Played, Trajectory
from benchmark.learning.settings import Options
from benchmark.scenario.scenario import Scenario, load_scenario

LEARNER = train.PPOSettings(steps=1, hidden=(8,))


def model(seed: int = 1) -> Any:
    return train._model(LEARNER, SIZE, seed)


def trajectory(rewards: list[float], *, ended: bool) -> Trajectory:
    count = len(rewards)
    return Trajectory(
        np.zeros((count, SIZE), np.float32),
        np.zeros((count, 2), np.float32),
        np.array(rewards, np.float32),
        ended,
    )


steps = st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=1, max_size=12)


@given(steps, st.booleans(), st.floats(0.0, 0.99), st.floats(0.0, 1.0))
def test_advantages_are_the_discounted_sum_of_surprises(
    given: list[tuple[float, float]], ended: bool, discount: float, decay: float
) -> None:
    rewards, values = ([one[i] for one in given] for i in (0, 1))
    found = ppo.advantages(
        trajectory(rewards, ended=ended), np.array(values, np.float32), discount, decay
    )
    after = [*values[1:], 0.0 if ended else values[-1]]
    for t in range(len(rewards)):
        wanted = sum(
            (discount * decay) ** (k - t) * (rewards[k] + discount * after[k] - values[k])
            for k in range(t, len(rewards))
        )
        assert found[t] == pytest.approx(wanted, abs=1e-3)


def test_a_batch_holds_each_decision_once_and_nothing_else() -> None:
    lengths = (3, 1, 5)
    of = [
        Trajectory(
            np.random.default_rng(n).random((n, SIZE), dtype=np.float32),
            np.zeros((n, 2), np.float32),
            np.ones(n, np.float32),
            True,
        )
        for n in lengths
    ]
    batch = ppo.Batch(model(), of, 0.9, 0.9, np.random.default_rng(1))
    rows = torch.cat([part.observations for part in batch.get(3)]).numpy()
    wanted = np.concatenate([one.observations for one in of])
    assert sorted(map(tuple, rows.tolist())) == sorted(map(tuple, wanted.tolist()))


def test_the_policy_in_episodes_is_the_one_that_learns() -> None:
    learner = model()
    rows = np.random.default_rng(2).random((7, SIZE), dtype=np.float32)
    with torch.no_grad():
        means = learner.policy.get_distribution(torch.from_numpy(rows)).distribution.mean.numpy()
    assert ActionNetwork(ppo.arrays(learner)).means(rows) == pytest.approx(means, abs=1e-5)
    assert ppo.spread(learner) == pytest.approx([LEARNER.spread] * 2)


def test_what_earns_more_is_done_more_often() -> None:
    learner = train._model(
        train.PPOSettings(steps=1, hidden=(8,), learning_rate=0.02, batch=256), SIZE, 1
    )
    learner.set_logger(Logger(None, []))
    random = np.random.default_rng(1)
    for _ in range(15):
        seen = random.random((256, SIZE), dtype=np.float32)
        means = ActionNetwork(ppo.arrays(learner)).means(seen)
        actions = (means + 0.6 * random.standard_normal(means.shape)).astype(np.float32)
        earned = Trajectory(seen, actions, (actions[:, 1] > RIGHT).astype(np.float32), True)
        learner.rollout_buffer = ppo.Batch(learner, [earned], 0.0, 0.9, random)  # type: ignore[assignment]
        learner.train()
    rows = random.random((100, SIZE), dtype=np.float32)
    assert (ActionNetwork(ppo.arrays(learner)).means(rows)[:, 1] > RIGHT).all()


def played(seed: int = 10_000, **facts: Any) -> Played:
    learner = model()
    arrays = {**ppo.arrays(learner), "spread": ppo.spread(learner)}
    return play(Exercise("hierarchical", smoke("crossing"), 0.6, seed, arrays, **facts))


def test_episodes_leave_each_vehicles_decisions_and_what_the_team_earned() -> None:
    found = played(reward=DrivingReward(waiting=0.0, standing=1.0))
    assert len(found.trajectories) > 3
    for one in found.trajectories:
        count = len(one.rewards)
        assert one.observations.shape == (count, SIZE)
        assert one.actions.shape == (count, 2)
        assert (one.rewards <= 0).all()
    assert min(one.rewards.min() for one in found.trajectories) < 0
    assert any(one.ended for one in found.trajectories)


def test_equal_arguments_give_equal_trajectories() -> None:
    one, same, other = played(), played(), played(10_001)
    pairs = zip(one.trajectories, same.trajectories, strict=True)
    assert all(np.array_equal(a.actions, b.actions) for a, b in pairs)
    assert not np.array_equal(one.trajectories[0].actions, other.trajectories[0].actions)


TINY = (
    *("traffic.scenarios=['smoke/crossing@960']", "traffic.rates=[0.6]", "traffic.duration=30"),
    *("traffic.episodes=2", "learner.steps=270", "learner.hidden=[8]"),
    *("validation.rounds=2", "validation.seeds=1", "validation.rates=[0.6]"),
)


def options(out: Path, **facts: Any) -> Options:
    return Options(out, changes=TINY, notify=lambda message: None, **facts)


def manifest(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "manifest.json").read_text())
    return found


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("hierarchical") / "run"
    with without_workers(rounds):
        train.train_hierarchical(options(out))
    return out


def test_a_run_leaves_weights_that_validated_best(finished: Path) -> None:
    left = manifest(finished)
    assert left["finished"]
    assert left["validation"] == min(one["waiting"] for one in left["validated"])
    assert (finished / "weights.safetensors").stat().st_size < 100_000
    assert "validation/waiting" in (finished / "logs" / "progress.csv").read_text()


def test_equal_seeds_give_equal_weights_for_any_number_of_workers(
    finished: Path, tmp_path: Path
) -> None:
    train.train_hierarchical(options(tmp_path / "run", workers=2))
    assert manifest(tmp_path / "run")["digest"] == manifest(finished)["digest"]
    with without_workers(rounds):
        train.train_hierarchical(options(tmp_path / "other", seed=2))
    assert manifest(tmp_path / "other")["digest"] != manifest(finished)["digest"]


def test_a_run_that_was_stopped_goes_on_as_if_it_had_not(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, learn = tmp_path / "run", train.LowLevelLearning._learn

    def stopped(self: Any, episodes: Any, before: int) -> Mapping[str, float]:
        if self.course.round == 4:
            raise KeyboardInterrupt
        return learn(self, episodes, before)

    with without_workers(rounds):
        with monkeypatch.context() as patch:
            patch.setattr(train.LowLevelLearning, "_learn", stopped)
            with pytest.raises(KeyboardInterrupt):
                train.train_hierarchical(options(out))
        assert manifest(out)["round"] == 2
        train.train_hierarchical(options(out, resume=True))
    assert manifest(out)["digest"] == manifest(finished)["digest"]


ROAD = {"length": 150, "speed_limit": 13.89, "lanes": "R C C L"}
SIDE = {"length": 100, "speed_limit": 13.89, "lanes": "RCL"}
MAIN = {"left": 1, "cross": 900, "right": 1}
CROSS = {"left": 30, "cross": 250, "right": 1}
TOY = {
    "schema": 1,
    "title": "Two roads with two lanes each way, three in ten vehicles an RV",
    "evaluation": {"duration": 120, "warm_up": 0, "penetration_rates": [0.3], "seeds": 2},
    "intersection": {"control_zone": 90.0},
    "approaches": {
        "northbound": {"heading": 0, **ROAD},
        "eastbound": {"heading": 90, **SIDE},
        "southbound": {"heading": 180, **ROAD},
        "westbound": {"heading": 270, **SIDE},
    },
    "demand": [
        {
            "begin": 0,
            "end": 120,
            "northbound": MAIN,
            "southbound": MAIN,
            "eastbound": CROSS,
            "westbound": CROSS,
        }
    ],
}
LESSONS = (
    *("traffic.rates=[0.3]", "traffic.duration=120", "traffic.episodes=16"),
    *("reward.standing=0.0", "reward.pace=0.0", "reward.leads=1.0"),
    *("learner.steps=45_000", "learner.hidden=[16]", "learner.batch=1024"),
    *("learner.learning_rate=3e-3", "learner.discount=0.8", "learner.decay=0.8"),
    *("validation.rounds=100", "validation.seeds=1", "validation.rates=[0.3]"),
)


LANE = 1 + len(Beside._fields)
SIDES = ((SIZE_TUNED - 2 * LANE, -1), (SIZE_TUNED - LANE, 1))  # left, right


def towards(scenario: Scenario, arrays: Mapping[str, Numbers]) -> tuple[float, float]:
    """How often a policy wants the lane beside: where no RV leads it, and where one does."""
    wanted: tuple[list[bool], list[bool]] = [], []
    for seed in range(1001, 1007):
        exercise = Exercise("hierarchical-tuned", scenario, 0.3, seed, arrays)
        for one in play(exercise).trajectories:
            for seen, (_, change) in zip(one.observations, one.actions, strict=True):
                for place, sign in SIDES:
                    serves, led = seen[place : place + 2]
                    if serves:
                        wanted[int(led)].append(sign * change > RIGHT)
    assert min(map(len, wanted)) > 100
    return fmean(wanted[0]), fmean(wanted[1])


@pytest.mark.slow
def test_the_low_level_learns_to_move_to_an_unregulated_lane_when_that_is_rewarded(
    tmp_path: Path,
) -> None:
    path = tmp_path / "toy.toml"
    path.write_bytes(tomli_w.dumps(TOY).encode())
    changes = (f"traffic.scenarios=['{path}']", *LESSONS)
    train.train_tuned(Options(tmp_path / "run", changes=changes, notify=lambda message: None))
    learned = files.load(
        tmp_path / "run" / "weights.safetensors", shapes(SIZE_TUNED, (16,)), "train again"
    )
    unled, led = towards(load_scenario(path), learned.arrays)
    assert unled > 0.3
    assert unled > led + 0.15  # not merely fond of changing lanes

"""Wang's learner, piece by piece: network, returns, replay."""

import inspect
import re
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import torch
from factories.processes import PATIENCE
from factories.scenarios import smoke
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st
from stable_baselines3.common.logger import configure

from baselines.wang.controller import Wang, WangTuned
from baselines.wang.dqn import (
    DuelingPolicy,
    PrioritisedReplay,
    PrioritisedSamples,
    WangDQN,
    project,
)
from baselines.wang.policy import Greedy, shapes
from benchmark.learning.observation import Numbers, size
from benchmark.learning.rollout import Actions, Rollout, Trajectory, play
from benchmark.learning.rounds import SpacesOnly
from benchmark.learning.traffic import GO, STOP, Reward, Traffic

HIDDEN = (16, 16)
SPACES = SpacesOnly(size("paper"), spaces.Discrete(2))


def learner(atoms: int = 1, **settings: float) -> WangDQN:
    replay = {"alpha": 0.5, "beta": 1.0, "discount": 0.9, "reach": 1, **settings}
    model = WangDQN(
        DuelingPolicy,
        SPACES,
        buffer_size=100,
        replay_buffer_class=PrioritisedReplay,
        replay_buffer_kwargs={**replay, "random": np.random.default_rng(0)},
        policy_kwargs={"net_arch": list(HIDDEN), "atoms": atoms, "value_range": (-2.0, 2.0)},
        target_update_interval=5,
        seed=0,
        device="cpu",
    )
    model.set_logger(configure(None, []))
    return model


def trajectory(rewards: Sequence[float], ended: bool = True, mark: float = 0.0) -> Trajectory:
    """A vehicle whose k-th observation is filled with ``mark`` + k / 100."""
    steps = len(rewards)
    rows = mark + np.arange(steps + 1, dtype=np.float32)[:, None] / 100
    return Trajectory(
        observations=np.broadcast_to(rows, (steps + 1, size("paper"))).copy(),
        actions=np.arange(steps) % 2,
        rewards=np.asarray(rewards, dtype=np.float32),
        ended=ended,
    )


def rounded(numbers: Numbers) -> list[float]:
    return [round(one, 4) for one in numbers.tolist()]


def rows_of(replay: PrioritisedReplay) -> dict[str, list[float]]:
    held = replay.size()
    return {
        "seen": rounded(replay.observations[:held, 0, 0]),
        "next": rounded(replay.next_observations[:held, 0, 0]),
        "rewards": rounded(replay.rewards[:held, 0]),
        "dones": rounded(replay.dones[:held, 0]),
        "discounts": rounded(replay.discounts[:held]),
    }


@pytest.mark.parametrize("atoms", [1, 51])
def test_the_numpy_policy_computes_what_the_torch_network_does(atoms: int) -> None:
    network = learner(atoms).q_net
    arrays = {name: one.numpy() for name, one in network.state_dict().items()}
    assert {name: one.shape for name, one in arrays.items()} == shapes("paper", HIDDEN, atoms)
    seen = np.random.default_rng(1).random((40, size("paper")), dtype=np.float32)
    values = Greedy(arrays).values(seen)
    wanted = network(torch.from_numpy(seen)).detach().numpy()
    assert np.abs(values - wanted).max() < 1e-5
    assert np.array_equal(Greedy(arrays)(seen), wanted.argmax(axis=1))


def test_few_rows_and_many_get_the_same_actions() -> None:
    policy = Wang()._policy
    seen = np.random.default_rng(2).random((30, size("paper")), dtype=np.float32)
    few = [action for row in range(0, 30, 2) for action in policy(seen[row : row + 2])]
    assert few == policy(seen).tolist()
    assert 0 < sum(few) < len(few)


@pytest.mark.parametrize("atoms", [1, 51])
def test_where_nobody_decides_the_numpy_policy_decides_nothing(atoms: int) -> None:
    arrays = {name: one.numpy() for name, one in learner(atoms).q_net.state_dict().items()}
    assert Greedy(arrays)(np.zeros((0, size("paper")), dtype=np.float32)).shape == (0,)


def test_the_advantages_of_a_state_add_up_to_nothing() -> None:
    network = learner().q_net
    seen = torch.rand(7, size("paper"))
    value_only = learner().q_net
    value_only.load_state_dict(network.state_dict())
    torch.nn.init.zeros_(value_only.advantage.weight)
    torch.nn.init.zeros_(value_only.advantage.bias)
    means, values = network(seen).mean(dim=1), value_only(seen)
    assert torch.allclose(means, values[:, 0], atol=1e-6)
    assert torch.equal(values[:, 0], values[:, 1])


SUPPORT = torch.linspace(-2, 2, 5)


@given(
    st.lists(st.floats(0.01, 1), min_size=5, max_size=5),
    st.floats(-3, 3),
    st.sampled_from([0.0, 0.5, 0.9, 1.0]),
)
def test_projection_keeps_all_chances_and_the_mean_within_the_atoms(
    weights: list[float], reward: float, discount: float
) -> None:
    chances = torch.tensor([weights]) / sum(weights)
    found = project(chances, torch.tensor([[reward]]), torch.tensor([[discount]]), SUPPORT)
    assert found.min() >= 0
    assert found.sum().item() == pytest.approx(1, abs=1e-5)
    wanted = (chances * (reward + discount * SUPPORT).clamp(-2, 2)).sum().item()
    assert (found * SUPPORT).sum().item() == pytest.approx(wanted, abs=1e-5)


def test_a_terminal_reward_on_an_atom_is_that_atom() -> None:
    found = project(torch.full((1, 5), 0.2), torch.tensor([[1.0]]), torch.tensor([[0.0]]), SUPPORT)
    assert found.tolist() == [[0, 0, 0, 1, 0]]


@given(
    st.lists(st.floats(0.01, 1), min_size=5, max_size=5),
    st.integers(-6, 6),
)
def test_a_reward_of_whole_atoms_shifts_the_distribution_and_what_leaves_it_stays_at_its_ends(
    weights: list[float], shift: int
) -> None:
    chances = torch.tensor([weights]) / sum(weights)
    wanted = torch.zeros(1, 5)
    for atom in range(5):
        wanted[0, min(max(atom + shift, 0), 4)] += chances[0, atom]
    found = project(chances, torch.tensor([[float(shift)]]), torch.ones(1, 1), SUPPORT)
    assert torch.allclose(found, wanted, atol=1e-6)


@given(st.floats(-3, 3), st.integers(0, 2**32 - 1))
def test_after_the_last_decision_only_the_reward_counts(reward: float, seed: int) -> None:
    chances = torch.rand(2, 5, generator=torch.Generator().manual_seed(seed)).softmax(dim=1)
    rewards, nothing = torch.full((2, 1), reward), torch.zeros(2, 1)
    one, other = project(chances, rewards, nothing, SUPPORT)
    assert torch.allclose(one, other, atol=1e-6)
    assert (one * SUPPORT).sum().item() == pytest.approx(min(2, max(-2, reward)), abs=1e-5)


def test_the_distributional_target_is_that_of_the_online_networks_action() -> None:
    model = learner(atoms=5)  # at -2, -1, 0, 1, 2
    for network in (model.q_net, model.q_net_target):
        for parameter in network.parameters():
            torch.nn.init.zeros_(parameter)
    go_is_best = torch.tensor([[4.0, 0, 0, 0, 0], [0, 0, 0, 0, 4.0]])
    go_is_sure_of_0 = torch.tensor([[0, 0, 0, 0, 0], [0, 0, 200.0, 0, 0]])  # Stop is best, at 0.5
    model.q_net.advantage.bias.data = go_is_best.flatten()
    model.q_net_target.advantage.bias.data = go_is_sure_of_0.flatten()
    seen = torch.zeros(1, size("paper"))
    batch = PrioritisedSamples(
        observations=seen,
        actions=torch.tensor([[STOP]]),
        next_observations=seen,
        discounts=torch.tensor([[0.5]]),
        rewards=torch.tensor([[1.0]]),
        weights=torch.ones(1, 1),
        rows=np.zeros(1, dtype=np.int64),
    )
    # Go is followed: all chance at 0, moved to 1 + 0.5 * 0, the fourth atom
    centred = torch.tensor([2.0, 0, 0, 0, -2.0])  # online, of Stop
    wanted = -centred.log_softmax(dim=0)[3]
    assert model._errors(batch).item() == pytest.approx(wanted.item(), abs=1e-5)


def test_the_target_takes_the_online_networks_action_at_the_target_networks_value() -> None:
    model = learner()
    for network, advantage in ((model.q_net, (0.0, 4.0)), (model.q_net_target, (3.0, 1.0))):
        for parameter in network.parameters():
            torch.nn.init.zeros_(parameter)
        network.advantage.bias.data = torch.tensor(advantage)
    batch = PrioritisedSamples(
        observations=torch.zeros(1, size("paper")),
        actions=torch.tensor([[GO]]),
        next_observations=torch.zeros(1, size("paper")),
        discounts=torch.tensor([[0.5]]),
        rewards=torch.tensor([[0.25]]),
        weights=torch.ones(1, 1),
        rows=np.zeros(1, dtype=np.int64),
    )
    # online: Go is best and worth 2; the target network values Go at -1 (Stop, at 1, is not taken)
    target, taken = 0.25 + 0.5 * -1, 2.0
    assert model._errors(batch).item() == pytest.approx(abs(target - taken) - 0.5)


def test_rows_of_a_vehicle_end_where_it_entered_and_never_mix_with_the_next() -> None:
    replay = learner().replay_buffer
    replay.extend(trajectory([1, 2, 3]))
    replay.extend(trajectory([4, 5], ended=False, mark=0.5))
    assert rows_of(replay) == {
        "seen": [0.0, 0.01, 0.02, 0.5, 0.51],
        "next": [0.01, 0.02, 0.03, 0.51, 0.52],
        "rewards": [1, 2, 3, 4, 5],
        "dones": [0, 0, 1, 0, 0],
        "discounts": [0.9] * 5,
    }


def test_returns_of_several_steps_stop_at_the_vehicles_end() -> None:
    replay = learner(reach=2).replay_buffer
    replay.extend(trajectory([1, 2, 3]))
    replay.extend(trajectory([4], ended=False, mark=0.5))
    assert rows_of(replay) == {
        "seen": [0.0, 0.01, 0.02, 0.5],
        "next": [0.02, 0.03, 0.03, 0.51],
        "rewards": [2.8, 4.7, 3.0, 4.0],
        "dones": [0, 1, 1, 0],
        "discounts": [0.81, 0.81, 0.9, 0.9],
    }


@given(st.lists(st.integers(1, 30), min_size=1, max_size=12))
def test_a_full_replay_forgets_the_oldest_rows(lengths: list[int]) -> None:
    replay = PrioritisedReplay(
        *(20, SPACES.observation_space, SPACES.action_space),
        alpha=0.5,
        beta=0.4,
        discount=0.9,
        random=np.random.default_rng(0),
    )
    rewards = np.arange(sum(lengths), dtype=np.float32)
    start = 0
    for length in lengths:
        if length <= 20:
            replay.extend(trajectory(rewards[start : start + length].tolist()))
            start += length
    held = sorted(replay.rewards[: replay.size(), 0].tolist())
    assert held == rewards[max(0, start - 20) : start].tolist()


def test_a_vehicle_with_more_decisions_than_the_replay_holds_leaves_its_last_ones() -> None:
    replay = PrioritisedReplay(
        *(20, SPACES.observation_space, SPACES.action_space),
        alpha=0.5,
        beta=0.4,
        discount=0.9,
        random=np.random.default_rng(0),
    )
    replay.extend(trajectory(list(range(45))))
    assert sorted(replay.rewards[:, 0].tolist()) == list(range(25, 45))
    assert replay.dones.sum() == 1


def test_samples_follow_the_priorities_and_weights_undo_their_bias() -> None:
    replay = learner(beta=1.0).replay_buffer
    replay.extend(trajectory([0.0] * 4))
    errors = np.array([1.0, 4.0, 9.0, 16.0], dtype=np.float32)
    replay.update(np.arange(4), errors)
    drawn = [replay.sample(100) for _ in range(100)]
    counts = np.bincount(np.concatenate([one.rows for one in drawn]), minlength=4)
    assert counts / counts.sum() == pytest.approx(np.array([1, 2, 3, 4]) / 10, abs=0.01)
    weighed = np.zeros(4)
    for one in drawn:
        np.add.at(weighed, one.rows, one.weights.numpy()[:, 0])
    assert weighed / weighed.sum() == pytest.approx(np.full(4, 0.25), abs=0.01)


def test_new_rows_get_the_highest_priority_there_is() -> None:
    replay = learner().replay_buffer
    replay.extend(trajectory([0.0] * 3))
    assert replay.priorities[:3].tolist() == [1, 1, 1]
    replay.update(np.array([1]), np.array([7.0], dtype=np.float32))
    replay.extend(trajectory([0.0]))
    assert replay.priorities[:4] == pytest.approx([1, 7, 1, 7], abs=1e-5)


@pytest.mark.parametrize("atoms", [1, 21])
def test_gradient_steps_find_the_better_action(atoms: int) -> None:
    model = learner(atoms)
    random = np.random.default_rng(2)
    for _ in range(30):
        seen = np.full((2, size("paper")), 0.5, dtype=np.float32)
        action = int(random.integers(2))
        reward = np.array([1.0 if action == GO else -1.0], dtype=np.float32)
        model.replay_buffer.extend(Trajectory(seen, np.array([action]), reward, ended=True))
    model.lr_schedule = lambda _: 3e-3
    model.train(300, 32)
    values = model.q_net(torch.full((1, size("paper")), 0.5)).detach().numpy()[0]
    assert values[GO] == pytest.approx(1, abs=0.2)
    assert values[STOP] == pytest.approx(-1, abs=0.2)


def seldom(observations: Numbers) -> Actions:
    """Go now and then, by the last digits of the distance."""
    return ((observations[:, 96] * 1000).astype(np.int64) % 5 == 0).astype(np.int64)


def test_nothing_of_an_absent_vehicle_enters_the_replay() -> None:
    """Counted again by hand: one row for each decision of an RV that was there, no other."""
    rollout = Rollout(smoke("crossing"), 0.7, 10_003, gridlock_after=None)
    played = play(rollout, seldom)
    with Traffic(rollout.scenario, 0.7, 10_003, gridlock_after=1e9) as traffic:
        moment, decisions, seen = traffic.first(), 0, []
        while not moment.over:
            decisions += len(moment.egos)
            seen.extend(moment.observations.tolist())
            actions = seldom(moment.observations)
            chosen = {one.id: int(a) for one, a in zip(moment.egos, actions, strict=True)}
            moment = traffic.step(chosen)
    assert decisions > 100
    assert sum(len(one.actions) for one in played.trajectories) == decisions
    learnt = [row for one in played.trajectories for row in one.observations[:-1].tolist()]
    assert sorted(learnt) == sorted(seen)
    replay = PrioritisedReplay(
        *(1000, SPACES.observation_space, SPACES.action_space),
        alpha=0.5,
        beta=0.4,
        discount=0.9,
        random=np.random.default_rng(0),
    )
    for one in played.trajectories:
        replay.extend(one)
    assert replay.size() == decisions
    assert replay.priorities[decisions:].sum() == 0  # what is not held is never drawn
    assert replay.sample(256).rows.max() < decisions
    assert replay.dones.sum() == sum(one.ended for one in played.trajectories)


def test_rewards_are_the_waiting_of_the_own_movement_and_the_penalty() -> None:
    reward = Reward(longest_wait=10.0, penalty=0.25, team=0.01)
    with Traffic(smoke("crossing"), 0.8, 10_001, reward=reward, gridlock_after=1e9) as traffic:
        moment, held, checked = traffic.first(), 0, 0
        while not moment.over:
            before = traffic.state
            actions = {one.id: (GO, STOP)[i % 2] for i, one in enumerate(moment.egos)}
            movements = {one.id: one.movement for one in moment.egos}
            moment = traffic.step(actions)
            now = traffic.state
            standing = sum(one.speed < 0.1 for one in now.vehicles)
            blocked = {one.id for one in now.vehicles if one.held_back}
            for name, decision in moment.followed.items():
                waiting = min(1.0, before.movements[movements[name]].waiting / 10)
                wanted = waiting if actions[name] == GO else -waiting
                wanted -= 0.25 * (name in blocked) + 0.01 * standing
                assert decision.reward == pytest.approx(wanted)
                held += name in blocked
                checked += 1
    assert held > 0
    assert checked > 100


def test_an_rv_earns_the_teams_reward_for_a_while_after_it_entered() -> None:
    quiet = Rollout(smoke("crossing"), 0.7, 10_003, reward=Reward(own=0, penalty=0, team=0.01))
    after = Rollout(
        smoke("crossing"),
        *(0.7, 10_003),
        reward=Reward(own=0, penalty=0, team=0.01, afterlife=5),
        discount=0.5,
    )
    plain, longer = (play(one, seldom).trajectories for one in (quiet, after))
    gains = [float(b.rewards[-1] - a.rewards[-1]) for a, b in zip(plain, longer, strict=True)]
    for a, b in zip(plain, longer, strict=True):
        assert np.array_equal(a.rewards[:-1], b.rewards[:-1])
    assert min(gains) < 0
    assert all(gain == 0 for gain, one in zip(gains, plain, strict=True) if not one.ended)


WITHOUT_EXTRAS = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("torch", "gymnasium", "pettingzoo", "stable_baselines3"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Absent())
from benchmark.scenario import catalogue
from benchmark.learning import trainers
from benchmark.study.episode import Episode, run_episode
from benchmark.plumbing.errors import ControllerError

(crossing,) = catalogue.find_scenarios(["smoke/crossing"])
for name in ("wang", "wang-tuned"):
    print(run_episode(Episode(crossing, name, 0.5, 1001)).status)
try:
    trainers.load("wang")
except ControllerError as error:
    print(error)
"""


def test_the_controllers_run_without_the_training_extras_and_the_trainer_asks_for_them() -> None:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_EXTRAS],
        capture_output=True,
        text=True,
        check=True,
        timeout=PATIENCE,
    )
    first, second, message = done.stdout.splitlines()
    assert (first, second) == ("ok", "ok")
    assert re.fullmatch(
        r"training \"wang\" needs \w+, which is not installed; pip install 'rightofway\[train\]'",
        message,
    )


@pytest.mark.parametrize(("kind", "layout"), [(Wang, "paper"), (WangTuned, "extended")])
def test_the_shipped_weights_say_how_they_were_trained(kind: type[Wang], layout: str) -> None:
    notes = kind()._weights.notes
    assert notes["layout"] == layout
    assert {"settings", "seed", "validation"} <= notes.keys()
    path = Path(inspect.getfile(kind)).parent / "weights" / f"{kind.NAME}.safetensors"
    assert path.stat().st_size < 5e6
    shipped = tomllib.loads((path.parents[1] / f"{kind.NAME}.toml").read_text())
    for table, settings in shipped.items():
        if isinstance(settings, dict):
            for key, value in settings.items():
                assert notes["settings"][table][key] == value, f"{table}.{key}"

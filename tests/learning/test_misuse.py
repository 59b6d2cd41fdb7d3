"""Environments under the hands of libraries, and of people who forget to close them."""

import gc
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from factories.scenarios import smoke
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st

from benchmark.learning.parallel import GoStopParallelEnv
from benchmark.learning.single import GoStopEnv
from benchmark.learning.traffic import GO, STOP, Traffic, checked
from benchmark.plumbing.errors import UsageError
from benchmark.sumo.simulation import Simulation

ENVIRONMENTS = pytest.mark.parametrize("kind", [GoStopEnv, GoStopParallelEnv])

INTEGERS = ["int8", "uint8", "int16", "int32", "int64", "uint32"]


@pytest.mark.parametrize("action", [STOP, GO])
@pytest.mark.parametrize("form", INTEGERS)
def test_numpy_scalars_and_arrays_of_no_dimension_are_actions(form: str, action: int) -> None:
    for given_ in (np.dtype(form).type(action), np.array(action, form), action, bool(action)):
        assert spaces.Discrete(2).contains(given_)
        assert checked(given_, "a") == action


SCALARS = st.one_of(
    st.integers(-3, 3),
    st.booleans(),
    st.floats(),
    st.none(),
    st.text(max_size=2),
    st.lists(st.integers(0, 1), max_size=2),
)


@given(SCALARS, st.sampled_from([*INTEGERS, "float32", "bool", "object", "U2"]), st.booleans())
def test_an_action_is_what_the_space_contains(value: Any, form: str, whole: bool) -> None:
    try:
        action = value if whole else np.array(value, dtype=form)
    except (ValueError, TypeError, OverflowError):
        return
    if spaces.Discrete(2).contains(action):
        assert checked(action, "a") == action
    else:
        with pytest.raises(UsageError, match="expected 0 for Stop or 1 for Go"):
            checked(action, "a")


def test_what_predict_returns_is_played(
    single: Callable[..., GoStopEnv], environment: Callable[..., GoStopParallelEnv]
) -> None:
    env = single()
    env.reset(seed=1)
    env.step(np.array(GO))
    env.close()
    several = environment()
    several.reset(seed=1)
    several.step(dict.fromkeys(several.agents, np.array(GO)))


def one_of(kind: Callable[..., Any], **arguments: Any) -> Any:
    return kind(smoke("crossing"), 0.7, **arguments)


@pytest.fixture(autouse=True)
def _nobody_holds_the_simulation() -> Iterator[None]:
    yield
    sys.last_value = None  # type: ignore[assignment]
    gc.collect()
    assert Simulation._ending is None or not Simulation._ending.alive


@ENVIRONMENTS
def test_an_environment_that_was_dropped_without_close_blocks_nobody(
    kind: Callable[..., Any],
) -> None:
    one_of(kind).reset(seed=1)
    dropped = one_of(kind)
    dropped.reset(seed=1)
    dropped.myself = dropped
    del dropped
    env = one_of(kind)
    env.reset(seed=1)
    env.close()


@ENVIRONMENTS
def test_an_environment_whose_user_failed_blocks_nobody(kind: Callable[..., Any]) -> None:
    def train() -> None:
        env = one_of(kind)
        env.reset(seed=1)
        raise ZeroDivisionError

    try:
        train()
    except ZeroDivisionError as error:
        sys.last_value = error  # as an interactive session keeps it
    env = one_of(kind)
    env.reset(seed=1)
    env.close()


@ENVIRONMENTS
@pytest.mark.parametrize("place", ["first", "step"])
def test_a_reset_that_failed_half_way_gives_the_simulation_up(
    kind: Callable[..., Any], place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: object) -> None:
        raise KeyboardInterrupt

    env, other = one_of(kind), one_of(kind)
    with monkeypatch.context() as patch:
        patch.setattr(Traffic, place, fail)
        with pytest.raises(KeyboardInterrupt):
            env.reset(seed=1)
    other.reset(seed=1)
    other.close()
    env.reset(seed=1)
    env.close()


@ENVIRONMENTS
def test_a_step_that_failed_gives_the_simulation_up(
    kind: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: object) -> None:
        raise MemoryError

    env, other = one_of(kind), one_of(kind)
    env.reset(seed=1)
    action = GO if kind is GoStopEnv else dict.fromkeys(env.agents, GO)
    with monkeypatch.context() as patch:
        patch.setattr(Traffic, "step", fail)
        with pytest.raises(MemoryError):
            env.step(action)
    other.reset(seed=1)
    other.close()
    with pytest.raises(UsageError, match="call reset first"):
        env.step(action)


def test_a_policy_of_the_others_that_fails_gives_the_simulation_up() -> None:
    def fail(seen: object) -> Any:
        raise ZeroDivisionError

    env, other = one_of(GoStopEnv, others=fail), one_of(GoStopEnv)
    env.reset(seed=1)
    with pytest.raises(ZeroDivisionError):
        env.step(GO)
    other.reset(seed=1)
    other.close()


def test_a_refused_action_ends_no_episode(single: Callable[..., GoStopEnv]) -> None:
    env = single()
    env.reset(seed=1)
    with pytest.raises(UsageError, match="expected 0 for Stop"):
        env.step(7)
    env.step(GO)


@ENVIRONMENTS
def test_a_refusal_says_whose_environment_holds_the_simulation(kind: Callable[..., Any]) -> None:
    env, other = one_of(kind), one_of(kind)
    env.reset(seed=1)
    with pytest.raises(
        UsageError, match=r"training on smoke/crossing at seed 10001 holds it\. Call its close\(\)"
    ):
        other.reset()
    env.close()


@ENVIRONMENTS
def test_unknown_options_of_reset_are_refused(kind: Callable[..., Any]) -> None:
    env = one_of(kind)
    with pytest.raises(UsageError, match='unknown option "rates"; expected "rate"'):
        env.reset(options={"rates": 0.5})
    for rate in (2.0, -0.1, "half", None, float("nan")):
        with pytest.raises(UsageError, match=r"rate .*: expected a share from 0 to 1"):
            env.reset(options={"rate": rate})


@ENVIRONMENTS
def test_a_rate_given_to_reset_holds_from_then_on(kind: Callable[..., Any]) -> None:
    env, other = one_of(kind), kind(smoke("crossing"), 1.0)
    env.reset(seed=1)
    told = env.reset(options={"rate": 1.0})
    assert env.rate == 1.0
    env.close()
    wanted = other.reset(seed=2)
    other.close()
    assert str(told) == str(wanted)

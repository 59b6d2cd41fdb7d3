"""What weights were trained on: declared, and kept in the record."""

import pytest
from factories.scenarios import smoke

from baselines import first_come
from baselines.wang import controller
from benchmark.control.training import FIRST_TRAINING_SEED, Training, declared_training
from benchmark.study.episode import Episode, run_episode


@pytest.mark.parametrize(
    ("first", "last", "said"),
    [
        (2000, 9999, "kept for those who verify; train on 10000 to 2147483647"),
        (1001, 20_000, "the seeds 2000 to 9999 are kept"),
        (10_000, 2**31, "the seeds 2147483648 to 9223372036854775807 are kept"),
        (5, 4, "there are no seeds 5 to 4"),
        (-1, 4, "there are no seeds -1 to 4"),
        (10_000, 2**63, "there are no seeds"),
        (10_000, 2**31 - 1, None),
        (1, 1999, None),
    ],
)
def test_nobody_trains_on_seeds_kept_for_verifiers(first: int, last: int, said: str | None) -> None:
    problem = Training(scenarios=("smoke",), first=first, last=last).problem
    assert problem == said or (said and said in (problem or ""))


def test_notes_tell_training_and_validation_seeds() -> None:
    tables = {"traffic": {"scenarios": ["a", "b/c"], "seeds": 200}, "validation": {"seeds": 3}}
    training, validation = declared_training({"settings": tables}) or ()
    assert (training.scenarios, training.first, training.last) == (("a", "b/c"), 10_000, 10_199)
    assert (validation.first, validation.last) == (1001, 1003)


@pytest.mark.parametrize("notes", [{}, {"settings": None}, {"settings": {"traffic": {}}}])
def test_notes_that_do_not_say_declare_nothing(notes: dict[str, object]) -> None:
    assert declared_training(notes) is None


@pytest.mark.parametrize("kind", [controller.Wang, controller.WangTuned])
def test_shipped_weights_declare_traffic_that_no_evaluation_meets(
    kind: type[controller.Wang],
) -> None:
    training = kind().trained_on
    assert training
    for seed in range(1, 1001):
        assert not any(one.meets("colorado-springs/334", seed) for one in training)
    assert training[0].meets("colorado-springs/334", FIRST_TRAINING_SEED)


def test_a_record_holds_what_the_controller_declares() -> None:
    record = run_episode(Episode(smoke("tee"), "wang", 0.5, 1))
    assert record.trained_on == controller.Wang().trained_on
    assert run_episode(Episode(smoke("tee"), "first-come", 0.5, 1)).trained_on is None


@pytest.mark.parametrize("nonsense", ["seeds 1 to 5", [1, 2], {"first": 1}])
def test_a_declaration_that_makes_no_sense_fails_the_episode(
    nonsense: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_come.FirstCome, "trained_on", nonsense)
    record = run_episode(Episode(smoke("tee"), "first-come", 0.5, 1))
    assert record.status == "failed"
    assert "trained_on raised ValidationError" in (record.reason or "")

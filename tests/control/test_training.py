"""What weights were trained on: declared, and kept in the record."""

import pytest
from factories.scenarios import smoke

from baselines import first_come
from baselines.wang import controller
from benchmark.control.training import FIRST_TRAINING_SEED, declared_training
from benchmark.study.episode import Episode, run_episode


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

"""What a folder holds need not be run: by identity, not by name."""

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from factories.scenarios import smoke
from hypothesis import given
from hypothesis import strategies as st

from benchmark.records import table
from benchmark.records.record import Record
from benchmark.study import resume
from benchmark.study.episode import Episode
from benchmark.study.outcome import Outcome

ONE = Episode(smoke("tee"), "virtual-signal", 0.5, 1)


def kept_and_missing(
    episodes: list[Episode], records: list[Record]
) -> tuple[list[tuple[Episode, Outcome]], list[Episode]]:
    return resume.kept_and_missing(episodes, table.records_table(records))


def record(status: Any = "ok", **changes: Any) -> Record:
    return ONE.record(status).model_copy(update=changes)


@pytest.mark.parametrize(
    ("status", "is_held"),
    [
        ("ok", True),
        ("failed", True),
        ("skipped", True),
        ("crashed", False),
        ("timed out", False),
    ],
)
def test_what_is_settled_is_held_and_what_broke_off_is_run_again(
    status: str, is_held: bool
) -> None:
    one = record(status)
    assert kept_and_missing([ONE], [one]) == (
        ([(ONE, Outcome.of(one))], []) if is_held else ([], [ONE])
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"identity": None},  # from before identities were kept
        {"identity": "0" * 64},  # by other code
        {"scenario": "smoke/other"},  # its row would have the other name
        {"seed": 2},
        {"rate": None},
    ],
)
def test_records_of_another_episode_or_of_other_code_hold_nothing(changes: dict[str, Any]) -> None:
    assert kept_and_missing([ONE], [record(**changes)]) == ([], [ONE])


def test_the_newest_record_counts_as_on_the_leaderboard() -> None:
    old, new = record(), record("failed", reason="so")
    assert kept_and_missing([ONE], [old, new]) == ([(ONE, Outcome.of(new))], [])
    assert kept_and_missing([ONE], [old, record("crashed")]) == ([], [ONE])
    assert kept_and_missing([ONE], [record("crashed"), old]) == ([(ONE, Outcome.of(old))], [])
    other = record(identity="0" * 64)
    assert kept_and_missing([ONE], [old, other]) == ([], [ONE])


def test_code_that_was_edited_and_is_as_it_was_runs_again_but_another_file_is_another() -> None:
    for origin, is_held in (("mine 1.0", False), ("mine.py", True)):
        one = record(controller_from=f"{origin} sha256:{'1' * 64}")
        other = record(controller_from=f"{origin} sha256:{'2' * 64}", identity="0" * 64)
        assert bool(kept_and_missing([ONE], [one, other])[0]) is is_held


@given(st.sets(st.integers(0, 20)))
def test_every_episode_is_either_held_or_to_be_run_in_the_order_given(done: set[int]) -> None:
    chosen = [dataclasses.replace(ONE, seed=seed) for seed in range(20)]
    found, waiting = kept_and_missing(
        chosen, [chosen[seed].record("ok") for seed in done if seed < 20]
    )
    assert [one.seed for one, _ in found] == sorted(done - {20})
    assert [one.seed for one in waiting] == [seed for seed in range(20) if seed not in done]


def test_an_episode_that_ended_well_without_its_keepsake_is_run_again(tmp_path: Path) -> None:
    logs = resume.action_logs(tmp_path)
    for status, wanted in (("ok", [ONE]), ("skipped", [])):
        _, missing = resume.kept_and_missing([ONE], table.records_table([record(status)]), [logs])
        assert missing == wanted
    there = dataclasses.replace(logs, is_there=lambda folder, key, identity: True)
    _, missing = resume.kept_and_missing([ONE], table.records_table([record("ok")]), [there])
    assert missing == []

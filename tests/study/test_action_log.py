"""Action logs: whole, self-contained, and refused with one message when they are not."""

from functools import cache
from pathlib import Path
from typing import Any

import polars
import pytest
from factories.logs import head_of, rewritten, sealed
from factories.records import record
from factories.scenarios import SHIPPED, shipped, smoke
from hypothesis import given
from hypothesis import strategies as st

from benchmark.plumbing.errors import ActionLogError, StoreError
from benchmark.records.record import Record
from benchmark.scenario.scenario import Scenario
from benchmark.study import action_log, rescoring
from benchmark.study.actions import Action, Recording

GO = Action(0, "intersection", "a", "go", None, None, None)


def of(scenario: Scenario, **facts: Any) -> Record:
    return record(scenario=scenario.name, scenario_hash=scenario.hash, **facts)


def written(
    folder: Path, scenario: Scenario | None = None, actions: tuple[Action, ...] = (GO,)
) -> Path:
    scenario = scenario or smoke("tee")
    recording = Recording()
    recording.programs, recording.actions = scenario.programs, list(actions)
    return action_log.write_log(folder, recording, of(scenario), scenario)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_log_holds_scenario_program_record_and_commands(tmp_path: Path, name: str) -> None:
    path = written(tmp_path, shipped(name))
    found = action_log.read_log(path)
    assert (found.scenario, found.scenario.name) == (shipped(name), name)
    assert found.scenario.hash == shipped(name).hash
    assert (found.programs, found.record) == (shipped(name).programs, of(shipped(name)))
    assert list(found.actions) == [GO]
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


def test_a_scenario_at_another_demand_is_held_as_it_ran(tmp_path: Path) -> None:
    scaled = smoke("tee").at_demand(701.3)
    found = action_log.read_log(written(tmp_path, scaled))
    assert (found.scenario.name, found.scenario.hash) == ("smoke/tee@701.3", scaled.hash)
    rescoring.check_scenario(found)


def test_an_episode_without_commands_has_a_log(tmp_path: Path) -> None:
    assert action_log.read_log(written(tmp_path, actions=())).actions == []


def test_a_log_is_replaced_and_told_from_that_of_every_other_episode(tmp_path: Path) -> None:
    assert written(tmp_path) == written(tmp_path, actions=(GO, GO))
    others = [
        *(record("a/b"), record("a-b"), record("a-b", seed=2), record("a-b", rate=0.25)),
        *(
            record("a-b", scenario_hash="b" * 64),
            record(f"{'../' * 30}x"),
            record("a-b", rate=None),
        ),
    ]
    names = {action_log.log_name(one.episode) for one in others}
    assert len(names) == len(others)
    assert all(Path(one).name == one and len(one) < 200 for one in names)


def message(path: Path) -> str:
    with pytest.raises(ActionLogError) as caught:
        action_log.read_log(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text.removeprefix(f"{path}: ")


def test_a_changed_log_does_not_match_its_hash(tmp_path: Path) -> None:
    path = written(tmp_path)
    head = head_of(path)
    rewritten(path, head, action_log.frame([GO._replace(command="stop")]))
    assert "it was changed after it was written" in message(path)
    rewritten(path, head, action_log.frame([GO]))
    assert list(action_log.read_log(path).actions) == [GO]
    head["record"]["seed"] = 2
    rewritten(path, head)
    assert "it was changed after it was written" in message(path)


def test_a_log_of_another_scenario_names_both_hashes(tmp_path: Path) -> None:
    path = written(tmp_path)
    sealed(path, scenario=head_of(written(tmp_path, smoke("crossing")))["scenario"])
    assert smoke("crossing").hash[:12] in message(path)
    assert smoke("tee").hash[:12] in message(path)


def test_a_log_of_another_version_of_a_shipped_scenario_says_so(tmp_path: Path) -> None:
    changed = smoke("tee").with_demand(0.5)
    log = action_log.read_log(written(tmp_path, changed))
    with pytest.raises(ActionLogError, match=r"of another smoke/tee .* than the one that ships"):
        rescoring.check_scenario(log)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"format": 1}, "an action log of format 1, expected 2"),
        ({"record": {"schema": 1}}, "are none"),
        ({"record": None}, "are none"),
        ({"scenario": {"schema": 1}}, "are none"),
        ({"scenario": []}, "are none"),
        ({"programs": {"intersection": {"kind": "fixed"}}}, "are none"),
    ],
)
def test_metadata_of_another_kind_is_refused(
    tmp_path: Path, changes: dict[str, Any], said: str
) -> None:
    path = written(tmp_path)
    sealed(path, **changes)
    assert said in message(path)


def test_what_is_no_log_at_all_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    assert "cannot read the action log: No such file" in message(path)
    path.mkdir()
    assert "cannot read the action log: Is a directory" in message(path)
    path.rmdir()
    for content in (b"", b"PAR1", b"hello", b"PAR1 and no more PAR1"):
        path.write_bytes(content)
        assert "not an action log" in message(path)
    polars.DataFrame({"a": [1]}).write_parquet(path)
    assert "not an action log" in message(path)
    rewritten(path, {"format": 1})
    assert "not an action log" in message(path)
    for head in ([], "nonsense"):
        rewritten(path, head, action_log.frame([GO]))  # type: ignore[arg-type]
        assert "not an action log" in message(path)


def test_a_log_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, actions=(GO,) * 9)
    monkeypatch.setattr(action_log, "MOST_ACTIONS", 8)
    assert "more than 8 commands" in message(path)
    monkeypatch.setattr(action_log, "LARGEST", 100)
    assert "larger than an action log can be" in message(path)


@cache
def sample(folder: Path) -> bytes:
    return written(folder, actions=tuple(GO._replace(step=step) for step in range(50))).read_bytes()


@given(data=st.data())
def test_a_log_that_was_cut_is_refused(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.getbasetemp() / "cut"
    folder.mkdir(exist_ok=True)
    whole = sample(folder)
    path = folder / "cut.parquet"
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    assert "not an action log" in message(path)


def test_a_disk_that_refuses_is_named_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="cannot write the action log"):
        written(tmp_path / "absent")


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    path = written(tmp_path)
    many = action_log.MOST_ACTIONS + 1
    rows = action_log.frame([GO]).select(polars.all().repeat_by(many).explode())
    rewritten(path, head_of(path), rows)
    with pytest.raises(ActionLogError, match="more than 2000000 commands"):
        action_log.read_log(path)


def test_texts_that_each_row_would_repeat_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path)
    for text, count in (("x" * 2000, 2), ("x" * 900, 400_000)):
        row = action_log.frame([GO._replace(target=text)])
        rewritten(path, head_of(path), row.select(polars.all().repeat_by(count).explode()))
        assert path.stat().st_size < 20_000
        with pytest.raises(ActionLogError, match="a text of"):
            action_log.read_log(path)


def test_metadata_that_is_nested_without_end_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path)
    for depth in (80, 5000):
        text = f'{{"record":{"[" * depth}{"]" * depth}}}'
        polars.read_parquet(path).write_parquet(path, metadata={action_log.KEY: text})
        with pytest.raises(ActionLogError, match="not an action log"):
            action_log.read_log(path)

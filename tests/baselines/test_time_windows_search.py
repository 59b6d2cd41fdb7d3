"""The search for settings of time windows: repeatable, resumable, scored as it says."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from factories.scenarios import DROP, edited
from factories.training import without_workers

from baselines.time_windows import tune
from benchmark.learning.settings import Options
from benchmark.plumbing.errors import UsageError


@pytest.fixture(scope="module", autouse=True)
def _here() -> Iterator[None]:
    with without_workers(tune):
        yield


SMALL = (
    *("scenarios=['smoke/crossing']", "rates=[0.6]", "reference='traffic-light'", "trials=3"),
    *("seeds=1", "finalists=1", "final_seeds=1"),
    "space={after=[0.4, 2.4, 0.2], later_slots=[0, 6, 1]}",
)


def options(out: Path, *changes: str, **facts: Any) -> Options:
    return Options(out, changes=(*SMALL, *changes), notify=lambda message: None, **facts)


def tried(out: Path) -> list[tuple[dict[str, float], float]]:
    return [(trial.params, trial.value or 0.0) for trial in tune._study(out / "trials.log").trials]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("search") / "run"
    tune.train(options(out))
    return out


def test_a_search_tries_what_ships_first_and_keeps_the_best_of_the_finalists(
    finished: Path,
) -> None:
    trials = tried(finished)
    assert len(trials) == 3
    assert trials[0][0] == {name: tune.SHIPPED[name] for name in ("after", "later_slots")}
    manifest = json.loads((finished / "manifest.json").read_text())
    assert manifest["finished"]
    assert len(manifest["final"]) == 2
    assert manifest["best"] == min(manifest["final"], key=manifest["final"].__getitem__)
    assert tune.reference(trials[0][0]) in manifest["final"]


def test_a_search_that_was_stopped_goes_on_as_if_it_had_not(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, scored = tmp_path / "run", tune.Scorer.score

    def interrupted(self: tune.Scorer, chosen: tune.Chosen) -> float:
        if len(tried(out)) == 2:
            raise KeyboardInterrupt
        return scored(self, chosen)

    with monkeypatch.context() as patch:
        patch.setattr(tune.Scorer, "score", interrupted)
        with pytest.raises(KeyboardInterrupt):
            tune.train(options(out))
    tune.train(options(out, resume=True))
    complete = [one for one in tried(out) if one[1]]
    assert complete == tried(finished)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("space={aftr=[0.0, 1.0, 0.1]}", 'unknown setting "aftr"; did you mean "after"?'),
        ("space={after=[1.0, 0.0, 0.1]}", "space.after: expected the lowest value first"),
        ("final_seeds=5000", "there are only 999 validation seeds"),
        ("trials=0", "trials: should be greater than 0"),
        ("reference='wang'", 'reference: "wang" needs RVs'),
    ],
)
def test_settings_that_make_no_sense_are_refused(tmp_path: Path, change: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        tune.train(options(tmp_path / "run", change))
    assert message in str(caught.value)


def test_a_reference_that_cannot_run_there_is_named(tmp_path: Path) -> None:
    file = tmp_path / "dark.toml"
    file.write_text(tomli_w.dumps(edited({"signal": DROP})))
    with pytest.raises(UsageError, match=r"traffic-light fails on .*dark, seed 1001"):
        tune.train(options(tmp_path / "run", f"scenarios=['{file}']"))

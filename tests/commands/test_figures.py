"""The command ``rightofway figures``: the same bytes each time, and one message for bad input."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from factories.records import filled, study
from typer.testing import CliRunner

from benchmark.commands.app import app
from benchmark.plumbing.errors import RightOfWayError
from benchmark.reports.plots import gallery, style

Call = Callable[..., Any]


@pytest.fixture
def call(tmp_path: Path) -> Call:
    filled(tmp_path, *study(a=[30.0, 10.0], b=[5.0, 2.0]))

    def invoke(*arguments: str) -> Any:
        given = ["figures", "--records", str(tmp_path), *arguments]
        return CliRunner().invoke(app, given)

    return invoke


@pytest.mark.parametrize("form", style.FORMATS)
def test_the_same_records_give_the_same_bytes(call: Call, tmp_path: Path, form: str) -> None:
    names = ("waiting", "crossover")
    chosen = [part for name in names for part in ("--only", name)]
    for folder in ("one", "two"):
        done = call("--format", form, "--out", str(tmp_path / folder), *chosen)
        assert done.exit_code == 0, done.output
    for name in names:
        one, two = (tmp_path / folder / f"{name}.{form}" for folder in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()
    assert not (tmp_path / "one" / gallery.PAGE).exists()  # some figures alone make no page


def test_the_page_shows_every_figure_with_its_caption(call: Call, tmp_path: Path) -> None:
    done = call("--at", "0.2")
    assert done.exit_code == 0, done.output
    assert "training: nothing to draw; give the folders" in done.output
    page = (tmp_path / "figures" / gallery.PAGE).read_text()
    for kind in gallery.KINDS[:-1]:
        assert f"]({kind.name}.png)" in page
        assert (tmp_path / "figures" / f"{kind.name}.png").stat().st_size > 5000
    assert "At 20 % RVs." in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--format", "gif"], '--format "gif": expected png, svg, pdf'),
        (["--only", "wating"], '--only "wating": no such figure; did you mean "waiting"?'),
        (["--scenario", "b"], '--scenario "b": no records; known: test/a'),
        (["--controller", "aa"], '--controller "aa": no records; did you mean "a"?'),
        (["--training", "nowhere"], "nowhere: no logs of a training run (logs/progress.csv)"),
        (["--only", "training"], "nothing to draw"),
        (["--rate", "0.7"], "--rate 70 %: no records; at hand: 10 %, 20 %"),
        (["--records", "nowhere"], "nowhere/records: no records here"),
    ],
)
def test_bad_input_gets_one_message(call: Call, arguments: list[str], words: str) -> None:
    done = call(*arguments)
    assert isinstance(done.exception, RightOfWayError)
    assert words in str(done.exception)


def test_a_log_that_is_none_and_a_folder_that_is_a_file_are_named(
    call: Call, tmp_path: Path
) -> None:
    (tmp_path / "run" / "logs").mkdir(parents=True)
    (tmp_path / "run" / "logs" / "progress.csv").write_text("rollout/waiting\nmuch\n")
    done = call("--training", str(tmp_path / "run"))
    assert "progress.csv: not a log of a training run" in str(done.exception)
    (tmp_path / "file").write_text("")
    done = call("--out", str(tmp_path / "file" / "below"))
    assert "cannot write" in str(done.exception)

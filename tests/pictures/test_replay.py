"""Recorded episodes: what is kept, how small it is, pages beside records, and films."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from factories import smoke
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from typer.testing import CliRunner

from benchmark.commands.app import app
from benchmark.pictures.replay import varints
from benchmark.pictures.replay.document import document, trajectories
from benchmark.pictures.replay.film import film
from benchmark.pictures.replay.page import page
from benchmark.pictures.replay.recorder import Recorder
from benchmark.pictures.replay.replay import Replay, recorded
from benchmark.pictures.replay.trajectories import Told, Trajectories
from benchmark.plumbing.errors import RightOfWayError, TrajectoryError, UsageError
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.reports.site import replays
from benchmark.scenario import catalogue
from benchmark.study.episode import Episode, run

CROSSING = Episode(smoke("crossing"), "virtual-signal", 0.5, 1)
WITH_LIGHTS = dataclasses.replace(CROSSING, controller="traffic-light", rate=None)


@pytest.fixture(scope="module")
def kept() -> Trajectories:
    return recorded(CROSSING)


# --- what is kept ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "episode",
    [
        CROSSING,
        WITH_LIGHTS,
        dataclasses.replace(CROSSING, controller="hierarchical-tuned"),
        dataclasses.replace(CROSSING, scenario=smoke("asymmetric"), controller="time-windows"),
        dataclasses.replace(CROSSING, isolate=True),
    ],
)
def test_who_watches_changes_nothing(episode: Episode) -> None:
    still = {"wall_time": 0.0}
    watched = run(episode, recorder=Recorder())
    assert watched.model_copy(update=still) == run(episode).model_copy(update=still)


def test_everybody_is_there_while_on_the_road(kept: Trajectories) -> None:
    steps = kept.vehicles.steps
    assert len(steps) == len(kept.vehicles.id) == len(set(kept.vehicles.id)) > 20
    assert sum(steps) == len(kept.tracks.x) == len(kept.tracks.speed)
    assert kept.steps == smoke("crossing").evaluation.duration / kept.step
    told = {Told(int(one)) for one in np.unique(kept.tracks.told)}
    assert {Told.GO, Told.STOP} <= told
    assert (kept.tracks.speed >= 0).all()
    robots = np.repeat(kept.vehicles.robot, steps)
    assert not kept.tracks.told[~robots.astype(bool)].any()  # nobody tells an HV


def test_the_waiting_shown_is_the_records(kept: Trajectories) -> None:
    """The headline at the end of the episode."""
    (junction,) = kept.record.junctions.values()
    (curves,) = kept.curves
    assert curves.average[-1] == pytest.approx(junction.average_waiting_time)


@given(st.lists(st.integers(-(2**40), 2**40)))
def test_numbers_are_packed_without_loss(numbers: list[int]) -> None:
    packed = varints.encode(np.array(numbers, dtype=np.int64))
    assert varints.decode(packed).tolist() == numbers
    assert len(packed) <= 6 * len(numbers)


@pytest.mark.parametrize("data", [b"\x80", b"\x01\xff", b"\xff" * 12 + b"\x01"])
def test_numbers_that_are_cut_off_or_too_long_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"cut off|too long"):
        varints.decode(data)


def test_a_page_holds_what_was_kept_to_within_its_units(kept: Trajectories) -> None:
    found = trajectories(document(kept))
    assert found.record == kept.record.model_copy(update={"wall_time": 0.0})
    assert (found.vehicles, found.ground, found.steps) == (kept.vehicles, kept.ground, kept.steps)
    for name, unit in (("x", 0.02), ("y", 0.02), ("speed", 0.1), ("acceleration", 0.1)):
        off = np.abs(getattr(found.tracks, name) - getattr(kept.tracks, name))
        assert off.max() <= unit / 2 + 1e-9
    assert (found.tracks.told == kept.tracks.told).all()
    again = trajectories(document(found))  # rounded numbers stay as they are
    assert (again.tracks.x == found.tracks.x).all()


def test_a_long_episode_of_a_large_intersection_stays_small() -> None:
    episode = Episode(catalogue.one("449"), "time-windows", 0.6, 1)
    assert len(page.page([recorded(episode)])) < 3_000_000


# --- side by side ------------------------------------------------------------------------------


def test_only_the_same_traffic_stands_side_by_side(kept: Trajectories) -> None:
    other = recorded(dataclasses.replace(CROSSING, seed=2))
    with pytest.raises(TrajectoryError, match="are not the same traffic"):
        Replay([kept, other])
    with pytest.raises(TrajectoryError, match="5 episodes for one page; give one to 4"):
        Replay([kept] * 5)


def test_a_notebook_shows_the_page_in_a_frame_of_its_own(kept: Trajectories) -> None:
    shown = Replay([kept, recorded(WITH_LIGHTS)])
    assert repr(shown) == "Replay(virtual-signal and traffic-light on smoke/crossing, seed 1)"
    html = shown._repr_html_()
    assert html.startswith("<iframe")
    assert 'sandbox="allow-scripts"' in html
    assert "<script" not in html  # it is an attribute's text
    assert [one.controller for one in shown.records] == ["virtual-signal", "traffic-light"]


def test_what_does_not_end_well_has_nothing_to_show(monkeypatch: pytest.MonkeyPatch) -> None:
    def skipped(episode: Episode, **_: object) -> Record:
        return episode.record("skipped", reason="too few RVs")

    monkeypatch.setattr("benchmark.pictures.replay.replay.run", skipped)
    with pytest.raises(TrajectoryError, match="seed 1: nothing to show, skipped: too few RVs"):
        Replay.of(CROSSING)


# --- beside the records of a run ---------------------------------------------------------------


Call = Callable[..., Any]


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Call:
    monkeypatch.chdir(tmp_path)

    def invoke(*arguments: object) -> Any:
        return CliRunner().invoke(app, [*map(str, arguments)])

    return invoke


RUN = ("run", "smoke/crossing", "--controller", "virtual-signal", "--seeds", 2)


def test_a_run_writes_a_page_for_each_episode_and_makes_up_for_missing_ones(
    call: Call, tmp_path: Path
) -> None:
    assert call(*RUN).exit_code == 0
    done = call(*RUN, "--record-trajectories", "--log-actions")
    assert done.exit_code == 0, done.output
    pages = sorted((tmp_path / "out" / "replays").glob("*.html"))
    assert len(pages) == 2
    assert len(Store(tmp_path / "out").read()) == 4
    (first, _) = replays.find(tmp_path / "out")
    assert (first.scenarios, first.controllers) == (("smoke/crossing",), ("virtual-signal",))
    pages[0].unlink()
    done = call(*RUN, "--record-trajectories")
    assert "1 of 2 episodes are in" in done.output
    assert sorted((tmp_path / "out" / "replays").glob("*.html")) == pages
    assert "2 of 2 episodes are in" in call(*RUN, "--record-trajectories").output


def test_a_full_disk_stops_the_run_and_says_so(call: Call, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "replays").write_text("")
    done = call(*RUN, "--record-trajectories")
    assert isinstance(done.exception, RightOfWayError)
    assert "cannot write replays" in str(done.exception)
    assert not Store(tmp_path / "out").table(empty=True).height


# --- the command -------------------------------------------------------------------------------


def test_the_command_writes_a_page_of_controllers_side_by_side(call: Call, tmp_path: Path) -> None:
    chosen = ("--controller", "virtual-signal", "--controller", "traffic-light", "--rate", 0.5)
    done = call("replay", "smoke/crossing", *chosen, "--seed", 1)
    assert done.output == "replay.html\n"
    text = (tmp_path / "replay.html").read_text()
    assert len(page.shows(text[: page.HEAD])) == 2
    assert call("replay", "smoke/crossing", *chosen, "--seed", 1, "-o", "b.html").exit_code == 0
    assert (tmp_path / "b.html").read_text() == text  # the same episodes, the same bytes


def test_a_log_is_shown_as_its_controller_drove(call: Call, tmp_path: Path) -> None:
    assert call(*RUN, "--log-actions").exit_code == 0
    log = sorted((tmp_path / "out" / "actions").glob("*.parquet"))[0]
    done = call("replay", log, "-o", "log.html")
    assert done.exit_code == 0, done.output
    assert "the same, bit for bit" in done.output
    assert done.output.endswith("log.html\n")
    call("replay", "smoke/crossing", "--controller", "virtual-signal", "-o", "run.html")
    one, other = ((tmp_path / name).read_text() for name in ("log.html", "run.html"))
    assert one.count("<canvas") == other.count("<canvas")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["smoke/crossing"], "smoke/crossing: a scenario; name who drives with --controller"),
        (["nothing.parquet"], "nothing.parquet: cannot read the action log"),
        (["a", "b", "--controller", "wang"], "one scenario at a time, not 2: a, b"),
        (["nowhere", "--controller", "wang"], "nowhere"),
        (["tee", "--controller", "wong"], 'did you mean "wang"?'),
        (["tee", "--rate", "0.5"], "--rate and --seed go with a scenario"),
        (
            ["tee", "--controller", "wang", "--from", "5"],
            "--from and --to choose what a film",
        ),
        (["tee", "--controller", "wang", "--gif", "a.mp4"], "a.mp4: --gif writes another kind"),
        (["tee", "--controller", "wang", "--gif", "a.png"], "a.png: films are .gif or .mp4"),
        (["tee", "--controller", "wang", "-o", "file/x.html"], "cannot write"),
        (["tee", "--controller", "wang", "--gif", "a.gif", "--from", "999"], "nothing to film"),
    ],
)
def test_bad_input_gets_one_message(
    call: Call, tmp_path: Path, arguments: list[str], words: str
) -> None:
    (tmp_path / "file").write_text("")
    done = call("replay", *arguments)
    assert isinstance(done.exception, RightOfWayError), done.output
    assert words in str(done.exception)


def test_a_controller_that_fails_is_named(call: Call, tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text(
        "from benchmark.control.controller import Controller\nclass Bad(Controller):\n"
        "    def reset(self, intersection, seed): pass\n"
        "    def act(self, state): raise ValueError('no idea')\n"
    )
    done = call("replay", "smoke/crossing", "--controller", "bad.py:Bad")
    assert done.exit_code == 1
    assert "nothing to show, failed" in done.output
    assert "no idea" in done.output
    assert not (tmp_path / "replay.html").exists()


# --- films -------------------------------------------------------------------------------------


def test_a_gif_has_the_pictures_of_its_range(kept: Trajectories, tmp_path: Path) -> None:
    path = Replay([kept]).film(tmp_path / "a.gif", begin=40.0, end=48.0, speed=4.0)
    with Image.open(path) as found:
        assert (found.n_frames, found.size) == (25, film.SIZES[".gif"])
        assert len(found.convert("RGB").getcolors(2**24)) > 10


def test_an_mp4_lasts_as_long_as_its_range(kept: Trajectories, tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    shown = Replay([kept, recorded(WITH_LIGHTS)])
    path = shown.film(tmp_path / "a.mp4", begin=40.0, end=44.0, speed=4.0)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert (count, seconds) == (30, pytest.approx(1.0, abs=0.05))


def test_a_film_that_is_too_long_or_cannot_be_written_is_refused(
    kept: Trajectories, tmp_path: Path
) -> None:
    shown = Replay([kept])
    with pytest.raises(TrajectoryError, match="holds 60 s at most"):
        shown.film(tmp_path / "a.gif", begin=0.0, end=120.0, speed=1.0)
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot write"):
        shown.film(tmp_path / "file" / "a.gif", begin=40.0, end=41.0)
    assert [one.name for one in tmp_path.iterdir()] == ["file"]


def test_records_of_two_kinds_read_alike(kept: Trajectories) -> None:
    assert isinstance(kept.record, Record)
    assert page.shows(page.page([kept])[: page.HEAD]) == [CROSSING.identity]

"""Recorded episodes side by side, as a page or in a notebook."""

import dataclasses

import pytest
from factories.episodes import CROSSING, WITH_LIGHTS

from benchmark.pictures.replay.replay import Replay, recorded
from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.plumbing.errors import TrajectoryError
from benchmark.records.record import Record
from benchmark.study.episode import Episode


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
    def skipped(episode: Episode, _: object) -> Record:
        return episode.record("skipped", reason="too few RVs")

    monkeypatch.setattr("benchmark.pictures.replay.replay.run_episode", skipped)
    with pytest.raises(TrajectoryError, match="seed 1: nothing to show, skipped: too few RVs"):
        Replay.of(CROSSING)

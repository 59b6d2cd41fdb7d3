"""What a recorder keeps of an episode, and that it changes nothing."""

import dataclasses

import numpy as np
import pytest
from factories.episodes import CROSSING, WITH_LIGHTS
from factories.scenarios import smoke

from benchmark.pictures.replay.recorder import Recorder
from benchmark.pictures.replay.trajectories import Told, Trajectories
from benchmark.study.episode import Audience, Episode, run_episode


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
    watched = run_episode(episode, Audience(onlooker=Recorder()))
    assert watched.model_copy(update=still) == run_episode(episode).model_copy(update=still)


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

"""An episode as a replay keeps it."""

import pytest
from factories.episodes import CROSSING

from benchmark.pictures.replay.replay import recorded
from benchmark.pictures.replay.trajectories import Trajectories


@pytest.fixture(scope="session")
def kept() -> Trajectories:
    return recorded(CROSSING)

"""What a film shows of a moment: whose colours, collisions, every junction."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from msgspec.structs import replace as replaced
from numpy.typing import NDArray

from benchmark.pictures.replay import signs, stage
from benchmark.pictures.replay.trajectories import Collision, Told, Trajectories

BUSY = 45.0  # s, when RVs and HVs are on the road


def picture(kept: Trajectories, time: float) -> NDArray[np.uint8]:
    """A moment in RGB."""
    figure = Figure(figsize=(8, 8), dpi=72, facecolor=stage.FIELD)
    canvas = FigureCanvasAgg(figure)
    shown = stage.Stage(figure.add_axes((0, 0, 1, 0.95)), kept, bar=0.05 * 8 * 72)
    canvas.draw()
    shown.show(time)
    return np.asarray(canvas.buffer_rgba())[..., :3]


def pixels(image: NDArray[np.uint8], colour: str) -> int:
    """How many pixels have a colour."""
    near = np.abs(image / 255 - np.array(to_rgb(colour))).max(axis=2)
    return int((near < 0.01).sum())


def test_rvs_hvs_and_the_ground_have_their_colours(kept: Trajectories) -> None:
    image = picture(kept, BUSY)
    for colour in (signs.RV, signs.HV, stage.ASPHALT, stage.FIELD):
        assert pixels(image, colour) > 20
    assert pixels(image, stage.CRASH) == 0
    without = replace(kept, vehicles=replaced(kept.vehicles, robot=[False] * len(kept.vehicles.id)))
    assert pixels(picture(without, BUSY), signs.RV) == 0


def test_a_collision_is_marked_where_it_happens_and_a_moment_longer(kept: Trajectories) -> None:
    step = round((BUSY - kept.start) / kept.step)
    ends = np.add(kept.vehicles.first, kept.vehicles.steps)
    present = np.flatnonzero((np.array(kept.vehicles.first) <= step) & (step < ends))
    pair = (int(present[0]), int(present[-1]))
    crashed = replace(kept, collisions=[Collision(step, step, pair, True)])
    assert pixels(picture(crashed, BUSY), stage.CRASH) > 20
    assert pixels(picture(crashed, BUSY + stage.AFTERGLOW - 1), stage.CRASH) > 20
    for time in (BUSY - kept.step, BUSY + stage.AFTERGLOW + kept.step):
        assert pixels(picture(crashed, time), stage.CRASH) == 0


def test_all_junctions_are_in_the_picture(kept: Trajectories) -> None:
    (junction,) = kept.ground.junctions
    x, y = junction.centre
    there = replaced(junction, id="there", centre=(x + 400.0, y))
    wide = replace(
        kept,
        ground=replaced(kept.ground, junctions=[junction, there]),
        curves=kept.curves * 2,
    )
    near, far = picture(kept, BUSY), picture(wide, BUSY)
    assert 0 < pixels(far, stage.ASPHALT) < pixels(near, stage.ASPHALT)


@pytest.mark.parametrize(
    ("told", "acceleration", "name"),
    [
        (Told.GO, 0.0, "go"),
        (Told.STOP, 0.0, "stop"),
        (Told.HELD, 0.0, "held"),
        (Told.DRIVE, 0.0, "even"),
        (Told.DRIVE, 1.0, "faster"),
        (Told.DRIVE, -1.0, "slower"),
    ],
)
def test_a_decision_shows_as_a_ring_in_its_colour(
    told: Told, acceleration: float, name: str, kept: Trajectories
) -> None:
    decision = signs.Decision(told, acceleration, 0)
    patches = list(signs.vehicle(kept.classes[0], True, decision, pixel=0.1))
    assert patches[0][1] == signs.RINGS[name]
    assert [colour for _, colour in patches[1:3]] == [signs.RV, signs.GLASS]
    aside = list(signs.vehicle(kept.classes[0], True, decision._replace(side=1), pixel=0.1))
    assert len(aside) == len(patches) + 1
    assert aside[-1][0][:, 0].max() < 0  # to the left


def test_who_was_told_nothing_has_no_sign(kept: Trajectories) -> None:
    nothing = signs.Decision(Told.NOTHING, 0.0, 0)
    patches = list(signs.vehicle(kept.classes[0], False, nothing, pixel=0.1))
    assert [colour for _, colour in patches] == [signs.HV, signs.GLASS]

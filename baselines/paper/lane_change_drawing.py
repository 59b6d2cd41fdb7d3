"""Draws a lane change that regulates a lane: the approach from above, before and after."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from baselines.paper.lane_change import LaneChange
from benchmark.control.state import Crossing, TrafficState, Vehicle
from benchmark.pictures.axes import (
    GROUND,
    PALE_ASPHALT,
    Scene,
    draw_asphalt,
    draw_markings,
    draw_stop_lines,
)
from benchmark.pictures.geometry import Points, points, ribbon, stretch
from benchmark.reports.plots import style
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import ground, network

ROBOT, HUMAN, LANE = "#C1121F", "#8D99A6", "#F0E442"  # red and grey differ in lightness as well
THICK, THIN = 1.8, 0.5  # points, of outlines
WIDTH = 1.9  # m of a vehicle
REACH = 55.0  # m from the middle of the view to its sides


def draw(scenario: Scenario, change: LaneChange, target: Path) -> None:
    """Draw the traffic before and after a lane change; the same change gives the same bytes.

    Args:
        scenario: where it happened.
        change: what happened.
        target: the PNG to write.

    Raises:
        UsageError: the file cannot be written.
    """
    built = network.build_network(scenario)
    junction = built.junctions[change.after.intersection.id]
    scene = Scene(scenario, junction, ground.surroundings(built))
    with style.styled():
        figure = Figure(figsize=(7.2, 4.2), facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        before, after = figure.subplots(1, 2)
        _panel(before, scene, change.before, change, "before")
        _panel(after, scene, change.after, change, "after")
        _legend(figure)
        style.save(figure, target)


def _panel(axes: Axes, scene: Scene, state: TrafficState, change: LaneChange, words: str) -> None:
    x, y = _middle(scene, change)
    axes.set(xlim=(x - REACH, x + REACH), ylim=(y - REACH, y + REACH), xticks=[], yticks=[])
    axes.set_aspect("equal")
    axes.set_facecolor(GROUND)
    axes.set_title(f"{words}: {state.time:g} s", loc="left")
    axes.spines[:].set(visible=True, color="#bbbbbb", linewidth=0.8)
    draw_asphalt(axes, scene, PALE_ASPHALT)
    lane = scene.intersection.lanes[change.target]
    axes.add_collection(PolyCollection([ribbon(points(lane.shape), lane.width)], facecolor=LANE))
    draw_markings(axes, scene)
    draw_stop_lines(axes, scene)
    _draw_vehicles(axes, scene, state, change.vehicle)


def _middle(scene: Scene, change: LaneChange) -> Points:
    """The middle of the view: so far upstream that the entrance is near its edge."""
    lane = points(scene.intersection.lanes[change.target].shape)
    backwards = stretch(lane, 0.0, 0.65 * REACH)
    assert backwards is not None
    return np.asarray(backwards[0])


def _draw_vehicles(axes: Axes, scene: Scene, state: TrafficState, changing: str) -> None:
    present: list[Vehicle | Crossing] = [*state.vehicles, *state.inside]
    for vehicle in present:
        part = _place(scene, vehicle)
        if part is not None:
            edge = THICK if vehicle.id == changing else THIN
            shape = PolyCollection(
                [ribbon(part, WIDTH)], edgecolor=style.INK, linewidth=edge, zorder=4
            )
            shape.set_facecolor(ROBOT if vehicle.is_robot else HUMAN)
            axes.add_collection(shape)


def _place(scene: Scene, vehicle: Vehicle | Crossing) -> Points | None:
    """The centre line of a vehicle from rear to front; None where it is off the drawing."""
    lanes = scene.intersection.lanes
    if isinstance(vehicle, Vehicle):
        upstream = scene.junction.zone[vehicle.lane].end  # m that lie behind the lane's end
        line, front = points(scene.ground.lanes[vehicle.lane].shape), vehicle.distance - upstream
    else:
        ways = scene.intersection.movements[vehicle.movement].ways
        way = next(way for way in ways if way.lane == vehicle.lane)
        line = np.vstack([points(lanes[vehicle.lane].shape), points(way.shape)[1:]])
        front = vehicle.way_length - vehicle.position
    return stretch(line, front, front + vehicle.body.length)


def _legend(figure: Figure) -> None:
    figure.legend(
        handles=list(_keys()), loc="outside lower center", ncols=4, frameon=False, handlelength=1.6
    )


def _keys() -> Iterator[Patch]:
    yield Patch(
        facecolor=ROBOT, edgecolor=style.INK, linewidth=THICK, label="RV that changes lanes"
    )
    yield Patch(facecolor=ROBOT, edgecolor=style.INK, linewidth=THIN, label="RV")
    yield Patch(facecolor=HUMAN, edgecolor=style.INK, linewidth=THIN, label="HV")
    yield Patch(facecolor=LANE, label="the lane it regulates")

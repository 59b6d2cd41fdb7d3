"""The plan: lanes, markings and zones, with a scale."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch, Polygon

from benchmark.pictures.axes import (
    ASPHALT,
    CONTROL_TINT,
    DECISION_TINT,
    Scene,
    draw_asphalt,
    draw_markings,
    draw_stop_lines,
    draw_zones,
    on_asphalt,
)
from benchmark.pictures.geometry import RoadPlace
from benchmark.pictures.sheet.sheet import (
    BARE,
    HEADING,
    INK,
    MARGIN,
    PLAN,
    STRIP,
    Sheet,
    extent,
    window,
)

NEAREST, FARTHEST = 40.0, 170.0  # m from the centre to a side


def panel(sheet: Sheet, scene: Scene, top: float, name: str) -> None:
    """The plan with its heading, and the junction's name where there are several."""
    sheet.heading(MARGIN, top, "a", f"Plan, lanes and zones{name}")
    draw(sheet, scene, MARGIN, top + HEADING)


def draw(sheet: Sheet, scene: Scene, left: float, top: float) -> None:
    """The plan itself, and its legend below."""
    axes = sheet.axes(left, top, PLAN, PLAN)
    reach = min(max(scene.radius + scene.intersection.control_zone + 8, NEAREST), FARTHEST)
    window(axes, scene, reach)
    draw_asphalt(axes, scene, ASPHALT)
    draw_zones(axes, scene)
    draw_markings(axes, scene)
    draw_stop_lines(axes, scene)
    for name, entrance in scene.entrances.items():
        _approach_label(axes, scene, name, entrance, reach)
    _legend_strip(sheet, scene, left, top + PLAN, reach)


def _approach_label(axes: Axes, scene: Scene, name: str, entrance: RoadPlace, reach: float) -> None:
    """The approach's name on the kerb side of its incoming lanes, near the edge of the view."""
    movements = scene.intersection.movements.values()
    first = next(movement.id for movement in movements if movement.approach == name)
    short = first.rpartition("-")[0]
    words = name if short == name else f"{name} ({short})"
    metre = 72 * PLAN / (2 * reach)  # points
    width, height = ((side + 14) / metre for side in extent(words, 9, "bold"))
    side = 1 if scene.intersection.driving_side == "right" else -1  # of the kerb
    lanes = scene.approaches[name]
    kerb = max(side * entrance.beside(np.array(lane.shape[-1])) for lane in lanes) + 1.6
    right = abs(entrance.right)
    aside = side * (kerb + (width * right[0] + height * right[1]) / 2 + 1.5)
    room = np.array([reach - width / 2 - 3, reach - height / 2 - 3])
    from_centre = entrance.at(aside, 0.0) - scene.centre
    limits = (room + np.sign(entrance.ahead) * from_centre) / np.maximum(abs(entrance.ahead), 1e-9)
    place = entrance.at(aside, -float(min(limits)))
    box = {"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": scene.colours[name]}
    looks: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9, "fontweight": "bold"}
    axes.text(place[0], place[1], words, bbox={"linewidth": 1.2, **box}, **looks)


def _legend_strip(sheet: Sheet, scene: Scene, left: float, top: float, reach: float) -> None:
    """Zones, scale bar and north below the plan, at the plan's scale."""
    axes = sheet.axes(left, top, PLAN, STRIP)
    axes.set(xlim=(0, 2 * reach), ylim=(0, 1))
    axes.axis("off")
    swatches = [
        tuple(Patch(facecolor=on_asphalt(colour, tint)) for colour in scene.colours.values())
        for tint in (CONTROL_TINT, DECISION_TINT)
    ]
    axes.legend(
        swatches,
        [
            f"control zone, {scene.intersection.control_zone:g} m",
            f"decision zone, {scene.intersection.decision_zone:g} m",
        ],
        handler_map={tuple: HandlerTuple(ndivide=None, pad=0)},
        handlelength=4,
        ncols=2,
        loc="center left",
        bbox_to_anchor=(0, 0.45),
        **BARE,
    )
    _scale_bar(axes, reach)


def _scale_bar(axes: Axes, reach: float) -> None:
    length = 50 if reach > 100 else 20
    end = 2 * reach * 0.93
    axes.plot([end - length, end], [0.35, 0.35], color=INK, linewidth=2, solid_capstyle="butt")
    axes.text(end - length / 2, 0.45, f"{length} m", ha="center", va="bottom", fontsize=8)
    north, half = 2 * reach * 0.98, 2 * reach * 0.011
    tip = [(north, 0.72), (north - half, 0.1), (north, 0.25), (north + half, 0.1)]
    axes.add_patch(Polygon(tip, facecolor=INK, edgecolor="none"))
    axes.text(north, 0.74, "N", ha="center", va="bottom", fontsize=8, fontweight="bold")

"""The plan: lanes, markings and zones, with a scale."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch, Polygon

from benchmark.pictures import axes as drawing
from benchmark.pictures.axes import Site, colour_of
from benchmark.pictures.geometry import Frame
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
from benchmark.scenario.layout import LETTERS

NEAREST, FARTHEST = 40.0, 170.0  # m from the centre to a side


def panel(sheet: Sheet, site: Site, top: float) -> None:
    """The plan with its heading."""
    sheet.heading(MARGIN, top, "a", "Plan, lanes and zones")
    draw(sheet, site, MARGIN, top + HEADING)


def draw(sheet: Sheet, site: Site, left: float, top: float) -> None:
    """The plan itself, and its legend below."""
    axes = sheet.axes(left, top, PLAN, PLAN)
    reach = min(max(site.radius + site.intersection.control_zone + 8, NEAREST), FARTHEST)
    window(axes, site, reach)
    drawing.draw_asphalt(axes, site, drawing.ASPHALT)
    drawing.draw_zones(axes, site)
    drawing.draw_markings(axes, site)
    drawing.draw_stop_lines(axes, site)
    for name, frame in site.entrances.items():
        _approach_label(axes, site, name, frame, reach)
    _legend_strip(sheet, site, left, top + PLAN, reach)


def _approach_label(axes: Axes, site: Site, name: str, frame: Frame, reach: float) -> None:
    """The approach's name on the kerb side of its incoming lanes, near the edge of the view."""
    words = f"{name} ({LETTERS[name]})" if name in LETTERS else name
    metre = 72 * PLAN / (2 * reach)  # points
    width, height = ((side + 14) / metre for side in extent(words, 9, "bold"))
    kerb = max(frame.beside(np.array(lane.shape[-1])) for lane in site.approaches[name]) + 1.6
    right = abs(frame.right)
    aside = kerb + (width * right[0] + height * right[1]) / 2 + 1.5
    room = np.array([reach - width / 2 - 3, reach - height / 2 - 3])
    from_centre = frame.at(aside, 0.0) - site.centre
    limits = (room + np.sign(frame.ahead) * from_centre) / np.maximum(abs(frame.ahead), 1e-9)
    place = frame.at(aside, -float(min(limits)))
    box = {"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": colour_of(name)}
    looks: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9, "fontweight": "bold"}
    axes.text(place[0], place[1], words, bbox={"linewidth": 1.2, **box}, **looks)


def _legend_strip(sheet: Sheet, site: Site, left: float, top: float, reach: float) -> None:
    """Zones, scale bar and north below the plan, at the plan's scale."""
    axes = sheet.axes(left, top, PLAN, STRIP)
    axes.set(xlim=(0, 2 * reach), ylim=(0, 1))
    axes.axis("off")
    swatches = [
        tuple(Patch(facecolor=drawing.zone_colour(name, tint)) for name in site.approaches)
        for tint in (drawing.CONTROL_TINT, drawing.DECISION_TINT)
    ]
    axes.legend(
        swatches,
        [
            f"control zone, {site.intersection.control_zone:g} m",
            f"decision zone, {site.intersection.decision_zone:g} m",
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

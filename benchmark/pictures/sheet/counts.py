"""The turning counts: a band for each movement, as wide as it has vehicles."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from benchmark.pictures.axes import (
    FLOW_TAIL,
    PALE_ASPHALT,
    Scene,
    draw_asphalt,
    draw_flows,
    draw_stop_lines,
    spread,
)
from benchmark.pictures.sheet.sheet import GAP, HEADING, MARGIN, PLAN, SIDE, Sheet, extent, window


def panel(sheet: Sheet, scene: Scene, top: float) -> None:
    """The counts with their heading."""
    left = MARGIN + PLAN + GAP
    period = scene.scenario.peak
    several = len(scene.scenario.demand) > 1
    when = f", peak from {period.begin:g} s to {period.end:g} s" if several else ""
    sheet.heading(left, top, "b", f"Turning counts [veh/h]{when}")
    draw(sheet, scene, left, top + HEADING)


def draw(sheet: Sheet, scene: Scene, left: float, top: float) -> None:
    """The counts themselves."""
    axes = sheet.axes(left, top, SIDE, SIDE)
    labels = {flow.movement: f"{flow.movement}  {flow.volume:.0f}" for flow in scene.flows}
    longest = max(extent(words, 8)[0] for words in labels.values())
    side = 72 * SIDE  # points
    reach = (scene.radius + FLOW_TAIL + 1) / (1 - 2 * (longest + 8) / side)
    window(axes, scene, reach)
    draw_asphalt(axes, scene, PALE_ASPHALT)
    draw_stop_lines(axes, scene)
    draw_flows(axes, scene, reach)
    for name in scene.approaches:
        _flow_labels(axes, scene, name, labels, 10.5 * 2 * reach / side)


def _flow_labels(
    axes: Axes, scene: Scene, approach: str, labels: dict[str, str], spacing: float
) -> None:
    """Each movement's count where its band begins, along the road."""
    entrance = scene.entrances[approach]
    flows = sorted(
        (flow for flow in scene.flows if flow.approach == approach), key=lambda flow: flow.place
    )
    rows = spread([flow.place for flow in flows], [spacing] * len(flows))
    angle = float(np.degrees(np.arctan2(entrance.ahead[1], entrance.ahead[0])))
    upright = -90 < angle <= 90
    looks: dict[str, Any] = {
        "rotation": angle if upright else angle + 180,
        "rotation_mode": "anchor",
        "ha": "right" if upright else "left",
        "va": "center_baseline",
    }
    for flow, row in zip(flows, rows, strict=True):
        x, y = entrance.at(row, -FLOW_TAIL - 1)
        axes.text(x, y, labels[flow.movement], **looks)

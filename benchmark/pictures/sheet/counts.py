"""The turning counts: a band for each movement, as wide as it has vehicles."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from benchmark.pictures import axes as drawing
from benchmark.pictures.axes import Site
from benchmark.pictures.sheet.sheet import GAP, HEADING, MARGIN, PLAN, SIDE, Sheet, extent, window
from benchmark.sumo.webster import peak


def panel(sheet: Sheet, site: Site, top: float) -> None:
    """The counts with their heading."""
    left = MARGIN + PLAN + GAP
    period = peak(site.scenario)
    several = len(site.scenario.demand) > 1
    when = f", peak from {period.begin:g} s to {period.end:g} s" if several else ""
    sheet.heading(left, top, "b", f"Turning counts [veh/h]{when}")
    draw(sheet, site, left, top + HEADING)


def draw(sheet: Sheet, site: Site, left: float, top: float) -> None:
    """The counts themselves."""
    axes = sheet.axes(left, top, SIDE, SIDE)
    labels = {flow.movement: f"{flow.movement}  {flow.volume:.0f}" for flow in site.flows}
    longest = max(extent(words, 8)[0] for words in labels.values())
    side = 72 * SIDE  # points
    reach = (site.radius + drawing.FLOW_TAIL + 1) / (1 - 2 * (longest + 8) / side)
    window(axes, site, reach)
    drawing.draw_asphalt(axes, site, drawing.PALE_ASPHALT)
    drawing.draw_stop_lines(axes, site)
    drawing.draw_flows(axes, site, reach)
    for name in site.approaches:
        _flow_labels(axes, site, name, labels, 10.5 * 2 * reach / side)


def _flow_labels(
    axes: Axes, site: Site, approach: str, labels: dict[str, str], spacing: float
) -> None:
    """Each movement's count where its band begins, along the road."""
    frame = site.entrances[approach]
    flows = sorted(
        (flow for flow in site.flows if flow.approach == approach), key=lambda flow: flow.place
    )
    rows = drawing.spread([flow.place for flow in flows], [spacing] * len(flows))
    angle = float(np.degrees(np.arctan2(frame.ahead[1], frame.ahead[0])))
    upright = -90 < angle <= 90
    looks: dict[str, Any] = {
        "rotation": angle if upright else angle + 180,
        "rotation_mode": "anchor",
        "ha": "right" if upright else "left",
        "va": "center_baseline",
    }
    for flow, row in zip(flows, rows, strict=True):
        x, y = frame.at(row, -drawing.FLOW_TAIL - 1)
        axes.text(x, y, labels[flow.movement], **looks)

"""Scenario -> drawing: the intersection from above, its turning counts and its signal program."""

import io
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch, Polygon, Rectangle
from matplotlib.textpath import TextPath

from benchmark import drawing, network
from benchmark.drawing import Site, colour_of
from benchmark.errors import UsageError
from benchmark.geometry import Frame
from benchmark.scenario import Scenario
from benchmark.scenario_tables import LETTERS, Phase, Signal
from benchmark.webster import peak

FORMATS = ("png", "svg")
INK, GREY = "#222222", "#555555"
BARE: dict[str, Any] = {"frameon": False, "borderpad": 0}  # looks of legends
STYLE = {
    "font.family": "sans-serif",
    "font.size": 8.0,
    "text.color": INK,
    "text.usetex": False,
    "text.parse_math": False,  # a scenario's words are words, whatever they hold
    "axes.labelcolor": INK,
    "hatch.linewidth": 1.2,
    "patch.linewidth": 0.0,
    "svg.fonttype": "none",
    "svg.hashsalt": "rightofway",
}

WIDTH, MARGIN, GAP = 12.6, 0.35, 0.5  # in
PLAN, SIDE, HEADING, STRIP = 7.2, 4.2, 0.3, 0.5  # in
LINE, TITLE_LINE = 0.15, 0.27  # in
NEAREST, FARTHEST = 40.0, 170.0  # m of the plan from the centre to a side
LIGHTS: dict[str, dict[str, Any]] = {  # looks of bars; Okabe-Ito
    "green": {"facecolor": "#009E73"},
    "permitted green": {"facecolor": "#d5eee4", "edgecolor": "#009E73", "hatch": "/////"},
    "yellow": {"facecolor": "#F0E442"},
    "all red": {"facecolor": "#D55E00"},
}


def draw(scenario: Scenario, target: Path) -> None:
    """Draw an intersection: plan, turning counts and signal program.

    The same scenario gives the same bytes.

    Args:
        scenario: what to draw.
        target: a file ending in ``.png`` or ``.svg``; its folder is made where it is missing.

    Raises:
        UsageError: another suffix, or a file that cannot be written.
        NetworkError: netconvert refuses the scenario's network.
    """
    form = target.suffix.lower().removeprefix(".")
    if form not in FORMATS:
        choices = " or ".join(f".{known}" for known in FORMATS)
        raise UsageError(f'{target}: cannot draw to "{target.suffix}"; use {choices}')
    with _style():
        figure = _figure(scenario)
        metadata = {"Date": None, "Title": _plain(scenario.title)} if form == "svg" else {}
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(target, format=form, dpi=180, metadata=metadata)
        except OSError as error:
            raise UsageError(
                f"{target}: cannot write the drawing: {error.strerror}; "
                "choose another file with --output"
            ) from error


@contextmanager
def _style() -> Iterator[None]:
    with matplotlib.style.context(["default", STYLE]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def _plain(words: str) -> str:
    """Words on one line, without characters that no font has and no XML allows."""
    return " ".join("".join(c if c.isprintable() else " " for c in words).split())


def _lines(words: str, width: int, most: int) -> list[str]:
    return textwrap.wrap(_plain(words), width, max_lines=most, placeholder=" …")


class _Sheet:
    """A page in inches from its upper left corner."""

    def __init__(self, height: float, width: float = WIDTH, ground: str = "white") -> None:
        self.height, self.width = height, width
        self.figure = Figure(figsize=(width, height), facecolor=ground)
        FigureCanvasAgg(self.figure)

    def axes(self, left: float, top: float, width: float, height: float) -> Axes:
        bottom = self.height - top - height
        return self.figure.add_axes(
            (left / self.width, bottom / self.height, width / self.width, height / self.height)
        )

    def text(self, left: float, top: float, words: str, **looks: Any) -> None:
        self.figure.text(left / self.width, 1 - top / self.height, words, va="top", **looks)


def panels(scenario: Scenario) -> dict[str, str]:
    """The plan and the turning counts as SVG documents of their own, for pages.

    The same scenario gives the same text.

    Raises:
        NetworkError: netconvert refuses the scenario's network.
    """
    site = _site(scenario)
    plan = _Sheet(PLAN + STRIP, PLAN, drawing.GROUND)
    counts = _Sheet(SIDE, SIDE, drawing.GROUND)
    with _style():
        _plan(plan, site, 0.0, 0.0)
        _counts(counts, site, 0.0, 0.0)
        return {"plan": _svg(plan.figure), "counts": _svg(counts.figure)}


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def _site(scenario: Scenario) -> Site:
    built = network.build(scenario)
    junction = next(iter(built.junctions.values()))
    return Site(scenario, junction, network.surroundings(built))


def _figure(scenario: Scenario) -> Figure:
    site = _site(scenario)
    title = _lines(scenario.title, width=88, most=3)
    foot = _footer(scenario)
    top = MARGIN + TITLE_LINE * len(title) + 0.1
    bottom = top + HEADING + PLAN + STRIP
    sheet = _Sheet(bottom + 0.15 + LINE * len(foot) + 0.2)
    sheet.text(MARGIN, MARGIN, "\n".join(title), fontsize=14, fontweight="bold", linespacing=1.25)
    _plan_panel(sheet, site, top)
    _counts_panel(sheet, site, top)
    _signal_panel(sheet, site, top + HEADING + SIDE + 0.3)
    sheet.text(MARGIN, bottom + 0.15, "\n".join(foot), fontsize=7, color=GREY, linespacing=1.3)
    return sheet.figure


def _footer(scenario: Scenario) -> list[str]:
    period = peak(scenario)
    total = sum(period.counts(name).total for name in scenario.approaches.names())
    words = f"Total demand: {total:.0f} veh/h in the peak period."
    if scenario.sources:
        words += f" Sources: {'; '.join(scenario.sources).rstrip('.')}."
    return _lines(words, width=205, most=4)


def _heading(sheet: _Sheet, left: float, top: float, letter: str, words: str) -> None:
    sheet.text(left, top, letter, fontsize=10, fontweight="bold")
    sheet.text(left + 0.2, top, words, fontsize=10)


def _window(axes: Axes, site: Site, reach: float) -> None:
    """A square view of the ground without a frame."""
    x, y = site.centre
    axes.set(xlim=(x - reach, x + reach), ylim=(y - reach, y + reach), xticks=[], yticks=[])
    axes.set_facecolor(drawing.GROUND)
    axes.spines[:].set_visible(False)


def _plan_panel(sheet: _Sheet, site: Site, top: float) -> None:
    _heading(sheet, MARGIN, top, "a", "Plan, lanes and zones")
    _plan(sheet, site, MARGIN, top + HEADING)


def _plan(sheet: _Sheet, site: Site, left: float, top: float) -> None:
    axes = sheet.axes(left, top, PLAN, PLAN)
    reach = min(max(site.radius + site.intersection.control_zone + 8, NEAREST), FARTHEST)
    _window(axes, site, reach)
    drawing.draw_asphalt(axes, site, drawing.ASPHALT)
    drawing.draw_zones(axes, site)
    drawing.draw_markings(axes, site)
    drawing.draw_stop_lines(axes, site)
    for name, frame in site.entrances.items():
        _approach_label(axes, site, name, frame, reach)
    _legend_strip(sheet, site, left, top + PLAN, reach)


def _extent(words: str, size: float, weight: str = "normal") -> tuple[float, float]:
    """Width and height of words [points]."""
    box = TextPath((0, 0), words, size=size, prop=FontProperties(weight=weight)).get_extents()
    return box.width, box.height


def _approach_label(axes: Axes, site: Site, name: str, frame: Frame, reach: float) -> None:
    """The approach's name on the kerb side of its incoming lanes, near the edge of the view."""
    words = f"{name} ({LETTERS[name]})" if name in LETTERS else name
    metre = 72 * PLAN / (2 * reach)  # points
    width, height = (extent / metre + 14 / metre for extent in _extent(words, 9, "bold"))
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


def _legend_strip(sheet: _Sheet, site: Site, left: float, top: float, reach: float) -> None:
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


def _counts_panel(sheet: _Sheet, site: Site, top: float) -> None:
    left = MARGIN + PLAN + GAP
    period = peak(site.scenario)
    several = len(site.scenario.demand) > 1
    when = f", peak from {period.begin:g} s to {period.end:g} s" if several else ""
    _heading(sheet, left, top, "b", f"Turning counts [veh/h]{when}")
    _counts(sheet, site, left, top + HEADING)


def _counts(sheet: _Sheet, site: Site, left: float, top: float) -> None:
    axes = sheet.axes(left, top, SIDE, SIDE)
    labels = {flow.movement: f"{flow.movement}  {flow.volume:.0f}" for flow in site.flows}
    longest = max(_extent(words, 8)[0] for words in labels.values())
    side = 72 * SIDE  # points
    reach = (site.radius + drawing.FLOW_TAIL + 1) / (1 - 2 * (longest + 8) / side)
    _window(axes, site, reach)
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


def _signal_panel(sheet: _Sheet, site: Site, top: float) -> None:
    left, signal = MARGIN + PLAN + GAP, site.scenario.signal
    if signal is None:
        _heading(sheet, left, top, "c", "Signal program")
        words = "None: the scenario has no signal program."
        sheet.text(left + 0.2, top + HEADING, words, color=GREY)
        return
    kind = "cycle up to" if signal.kind == "actuated" else "cycle"
    _heading(sheet, left, top, "c", f"Signal program: {signal.kind}, {kind} {signal.cycle:g} s")
    axes = sheet.axes(left + 0.45, top + 0.6, SIDE - 0.45, 1.7)
    _phase_diagram(axes, site, signal)
    _phase_heads(axes, signal)
    _light_legend(axes, site, signal)
    notes = "\n".join(_signal_notes(site, signal))
    sheet.text(left, top + 2.93, notes, fontsize=7, color=GREY, linespacing=1.3)


def _signal_notes(site: Site, signal: Signal) -> Iterator[str]:
    """What the diagram leaves out."""
    if signal.kind == "actuated":
        yield "Greens are the longest; ticks mark the shortest."
    if any(one.turn == "R" for one in site.intersection.movements.values()):
        yield "Right turns go with any green of their approach and yield; on red they stop first."
    if any(approach.slip_lane for _, approach in site.scenario.approaches.items()):
        yield "From a slip lane (broken stop line) they only yield."


def _phase_diagram(axes: Axes, site: Site, signal: Signal) -> None:
    """A row per regulated movement over one cycle."""
    movements = site.intersection.regulated_movements
    axes.set(xlim=(0, signal.cycle), ylim=(len(movements) - 0.4, -0.6))
    axes.set_yticks(range(len(movements)), movements)
    axes.set_xlabel("time in the cycle [s]", labelpad=1)
    axes.tick_params(length=2, labelsize=7.5)
    axes.tick_params(axis="y", length=0, pad=9)
    axes.spines[["top", "right", "left"]].set_visible(False)
    for row, name in enumerate(movements):
        axes.axhline(row, color="#cccccc", linewidth=0.8, zorder=0)
        patch = Rectangle((-0.02, row - 0.5), 0.012, 1.0, transform=axes.get_yaxis_transform())
        patch.set(color=colour_of(site.intersection.movements[name].approach), clip_on=False)
        axes.add_patch(patch)
        for start, length, light in lights(signal, name):
            axes.barh(row, length, 0.72, start, **LIGHTS[light])
        for start, phase, _ in _timeline(signal):
            if signal.kind == "actuated" and name in phase.movements:
                shortest = start + phase.minimum_green
                axes.vlines(shortest, row - 0.36, row + 0.36, colors=INK, linewidth=1.2)


def _timeline(signal: Signal) -> Iterator[tuple[float, Phase, Phase]]:
    """Each phase with its start [s] and the phase after it."""
    start = 0.0
    for phase, after in zip(signal.phases, (*signal.phases[1:], signal.phases[0]), strict=True):
        yield start, phase, after
        start += phase.green + signal.yellow + signal.all_red


def lights(signal: Signal, movement: str) -> Iterator[tuple[float, float, str]]:
    """What a movement sees over the cycle but red: start [s], length [s] and light."""
    for start, phase, after in _timeline(signal):
        end = start + phase.green
        light = "permitted green" if movement in phase.permitted else "green"
        if movement in phase.movements and movement in after.movements:
            yield start, phase.green + signal.yellow + signal.all_red, light
        elif movement in phase.movements:
            yield start, phase.green, light
            yield end, signal.yellow, "yellow"
            yield end + signal.yellow, signal.all_red, "all red"


def _phase_heads(axes: Axes, signal: Signal) -> None:
    """The phases' numbers, greens and boundaries."""
    above = axes.get_xaxis_transform()
    for number, (start, phase, _) in enumerate(_timeline(signal), start=1):
        if start:
            axes.axvline(start, color=INK, linewidth=0.7, linestyle=(0, (3, 2)), zorder=3)
        length = phase.green + signal.yellow + signal.all_red
        roomy = length > 0.12 * signal.cycle
        words = f"phase {number}\n{phase.green:g} s" if roomy else f"{number}"
        axes.text(start + length / 2, 1.03, words, transform=above, ha="center", fontsize=7.5)


def _light_legend(axes: Axes, site: Site, signal: Signal) -> None:
    """The lights that the program shows."""
    movements = site.intersection.regulated_movements
    seen = {light for name in movements for _, length, light in lights(signal, name) if length}
    shown = [light for light in LIGHTS if light in seen]
    axes.legend(
        [Patch(**LIGHTS[light]) for light in shown],
        shown,
        ncols=4,
        loc="upper left",
        bbox_to_anchor=(-0.13, -0.2),
        fontsize=7.5,
        handlelength=1.4,
        columnspacing=1.2,
        **BARE,
    )

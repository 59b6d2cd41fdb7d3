"""The signal program: what each movement sees over a cycle."""

from collections.abc import Iterator
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle

from benchmark.pictures.axes import Scene
from benchmark.pictures.sheet.sheet import (
    BARE,
    GAP,
    GREY,
    HEADING,
    INK,
    MARGIN,
    PLAN,
    SIDE,
    Sheet,
)
from benchmark.scenario.signal import Signal, SignalPhase

LIGHTS: dict[str, dict[str, Any]] = {  # looks of bars; Okabe-Ito
    "green": {"facecolor": "#009E73"},
    "permitted green": {"facecolor": "#d5eee4", "edgecolor": "#009E73", "hatch": "/////"},
    "yellow": {"facecolor": "#F0E442"},
    "all red": {"facecolor": "#D55E00"},
}


def panel(sheet: Sheet, scene: Scene, top: float) -> None:
    """The program with its heading, or that there is none."""
    left, signal = MARGIN + PLAN + GAP, scene.scenario.programs.get(scene.intersection.id)
    if signal is None:
        sheet.heading(left, top, "c", "Signal program")
        words = "None: the scenario has no signal program."
        sheet.text(left + 0.2, top + HEADING, words, color=GREY)
        return
    kind = "cycle up to" if signal.kind == "actuated" else "cycle"
    sheet.heading(left, top, "c", f"Signal program: {signal.kind}, {kind} {signal.cycle:g} s")
    axes = sheet.axes(left + 0.45, top + 0.6, SIDE - 0.45, 1.7)
    _phase_diagram(axes, scene, signal)
    _phase_heads(axes, signal)
    _light_legend(axes, scene, signal)
    notes = "\n".join(_notes(scene, signal))
    sheet.text(left, top + 2.93, notes, fontsize=7, color=GREY, linespacing=1.3)


def _notes(scene: Scene, signal: Signal) -> Iterator[str]:
    """What the diagram leaves out."""
    if signal.kind == "actuated":
        yield "Greens are the longest; ticks mark the shortest."
    if any(movement.keeps_to_kerb for movement in scene.intersection.movements.values()):
        side = scene.intersection.driving_side.capitalize()
        yield f"{side} turns go with any green of their approach and yield; on red they stop first."
    waiting = [name for name, road in scene.scenario.approaches.items() if not road.right_on_red]
    if waiting:
        yield f"No turn on red: {', '.join(waiting)}."
    if any(approach.slip_lane for _, approach in scene.scenario.approaches.items()):
        yield "From a slip lane (broken stop line) they only yield."


def _phase_diagram(axes: Axes, scene: Scene, signal: Signal) -> None:
    """A row per movement that has lights of its own over one cycle."""
    movements = _rows(scene, signal)
    axes.set(xlim=(0, signal.cycle), ylim=(len(movements) - 0.4, -0.6))
    axes.set_yticks(range(len(movements)), movements)
    axes.set_xlabel("time in the cycle [s]", labelpad=1)
    axes.tick_params(length=2, labelsize=7.5)
    axes.tick_params(axis="y", length=0, pad=9)
    axes.spines[["top", "right", "left"]].set_visible(False)
    for row, name in enumerate(movements):
        axes.axhline(row, color="#cccccc", linewidth=0.8, zorder=0)
        patch = Rectangle((-0.02, row - 0.5), 0.012, 1.0, transform=axes.get_yaxis_transform())
        approach = scene.intersection.movements[name].approach
        patch.set(color=scene.colours[approach], clip_on=False)
        axes.add_patch(patch)
        for start, length, light in lights(signal, name):
            axes.barh(row, length, 0.72, start, **LIGHTS[light])
        for start, phase, _ in _timeline(signal):
            if signal.kind == "actuated" and name in phase.movements:
                shortest = start + phase.minimum_green
                axes.vlines(shortest, row - 0.36, row + 0.36, colors=INK, linewidth=1.2)


def _rows(scene: Scene, signal: Signal) -> list[str]:
    """Regulated movements, and kerb turns that a phase names (overlaps)."""
    named = {name for phase in signal.phases for name in phase.movements}
    return [
        name
        for name, movement in scene.intersection.movements.items()
        if movement.regulated or name in named
    ]


def _timeline(signal: Signal) -> Iterator[tuple[float, SignalPhase, SignalPhase]]:
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


def _light_legend(axes: Axes, scene: Scene, signal: Signal) -> None:
    """The lights that the program shows."""
    movements = _rows(scene, signal)
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

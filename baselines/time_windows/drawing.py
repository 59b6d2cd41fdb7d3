"""Draws the windows of one conflict in a real episode, for docs/time-windows.md.

``python -m baselines.time_windows.drawing docs/time-windows.png`` makes the drawing in the docs.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from baselines.time_windows.watched import WatchedTimeWindows, watched
from benchmark.pictures import geometry
from benchmark.plumbing.errors import UsageError
from benchmark.scenario import catalogue
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import ground, network

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROBOT, HUMAN, REFUSED, INK = "#0072B2", "#999999", "#D55E00", "#222222"  # Okabe-Ito
CROSSING = ("#0072B2", "#009E73")  # the two ways of the conflict
LONG = 60.0  # s that are drawn


def busiest(traffic: WatchedTimeWindows) -> tuple[int, int, float]:
    """The two ways, and the time from which on, in which most RVs with windows take turns."""
    counts: dict[tuple[int, int, int], list[int]] = {}
    last = max(passing.track[-1][0] for passing in traffic.passings.values())
    for passing in traffic.passings.values():
        for other, (enters, _) in passing.windows.items():
            minute = int(enters // LONG)
            if minute == 0 or (minute + 1) * LONG <= last:
                pair = (min(passing.way, other), max(passing.way, other), minute)
                counts.setdefault(pair, [0, 0])[passing.way > other] += 1
    if not counts:
        raise UsageError("no RV held a window; give a higher rate")
    first, second, minute = max(counts, key=lambda key: (min(counts[key]), key))
    return first, second, minute * LONG


def draw(scenario: Scenario, rate: float, seed: int, target: Path) -> None:
    """Draw the windows of the busiest conflict over time, and where it is."""
    from matplotlib.figure import Figure

    traffic = watched(scenario, rate, seed)
    way, other, begin = busiest(traffic)
    figure = Figure(figsize=(12.0, 3.6), dpi=130, layout="constrained")
    plan, time = figure.subplots(1, 2, width_ratios=(1, 3.2))
    _plan(plan, scenario, traffic, (way, other))
    _time(time, traffic, (way, other), begin)
    time.set_title(f"{scenario.name}, {100 * rate:g} % RVs, seed {seed}", fontsize=9)
    figure.savefig(target)


def _plan(
    axes: "Axes", scenario: Scenario, traffic: WatchedTimeWindows, pair: tuple[int, int]
) -> None:
    """The intersection with two ways and the stretches on which they meet."""
    from benchmark.pictures.axes import ASPHALT, Scene, draw_asphalt, draw_stop_lines

    roads, conflicts = network.build_network(scenario), traffic.conflicts
    junction = roads.junctions[traffic.junction]
    scene = Scene(scenario, junction, ground.surroundings(roads))
    draw_asphalt(axes, scene, ASPHALT)
    draw_stop_lines(axes, scene)
    for (way, other), colour in zip((pair, pair[::-1]), CROSSING, strict=True):
        line = geometry.points(conflicts.ways[way].shape)
        axes.plot(*line.T, color=colour, linewidth=1.2)
        behind = conflicts.ways[way].length  # m from the end of the way, as drawings measure
        edges = behind - conflicts.end[way, other], behind - conflicts.start[way, other]
        stretch = geometry.stretch(line, *edges)
        if stretch is not None:
            axes.plot(*stretch.T, color=colour, linewidth=6, alpha=0.5, solid_capstyle="butt")
        axes.annotate(conflicts.movements[way], line[0], color=colour, fontsize=9, weight="bold")
    (x, y), reach = scene.centre, scene.radius + 4
    axes.set(xlim=(x - reach, x + reach), ylim=(y - reach, y + reach), xticks=[], yticks=[])
    axes.set_aspect("equal")
    axes.set_title("the two ways and the stretches they share", fontsize=9)


def _time(axes: "Axes", traffic: WatchedTimeWindows, pair: tuple[int, int], begin: float) -> None:
    """Windows held, times on the stretch and refusals, a row for each of the two ways."""
    conflicts = traffic.conflicts
    for row, (way, other) in enumerate((pair, pair[::-1])):
        stretch = float(conflicts.start[way, other]), float(conflicts.end[way, other])
        for passing in traffic.passings.values():
            if passing.way != way or passing.track[-1][1] < stretch[0]:
                continue
            enters, leaves = passing.on(stretch)
            colour = ROBOT if passing.is_robot else HUMAN
            axes.broken_barh([(enters, leaves - enters)], (row - 0.16, 0.32), facecolor=colour)
            if passing.windows:
                starts, ends = passing.windows[other]
                window = [(starts, ends - starts)]
                axes.broken_barh(window, (row - 0.28, 0.56), facecolor="none", edgecolor=INK)
            if passing.refused:
                axes.plot(
                    [passing.refused[0], passing.refused[-1]], [row - 0.38] * 2, color=REFUSED
                )
    axes.set_yticks([0, 1], [conflicts.movements[way] for way in pair])
    for label, colour in zip(axes.get_yticklabels(), CROSSING, strict=True):
        label.set(color=colour, weight="bold")
    axes.set(xlim=(begin, begin + LONG), ylim=(-0.6, 1.6), xlabel="time [s]")
    axes.spines[["top", "right"]].set_visible(False)
    _legend(axes)


def _legend(axes: "Axes") -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    axes.legend(
        handles=[
            Patch(color=ROBOT, label="RV on the stretch"),
            Patch(color=HUMAN, label="HV on the stretch"),
            Patch(facecolor="none", edgecolor=INK, label="window held when accepted last"),
            Line2D([], [], color=REFUSED, label="an RV is refused"),
        ],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.16),
        ncols=4,
        frameon=False,
        fontsize=8,
    )


def main(
    target: Annotated[Path, typer.Argument(help="File to write, .png or .svg.")],
    scenario: Annotated[str, typer.Option(help="With one junction.")] = "334",
    rate: Annotated[float, typer.Option(min=0, max=1)] = 0.6,
    seed: Annotated[int, typer.Option(min=0)] = 1,
) -> None:
    """Draw the windows of the busiest conflict of an episode under time windows."""
    draw(catalogue.find_scenario(scenario), rate, seed, target)


if __name__ == "__main__":
    typer.run(main)

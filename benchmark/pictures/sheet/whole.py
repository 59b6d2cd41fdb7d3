"""The whole drawing as a file, or its parts for pages."""

import io
from pathlib import Path

from matplotlib.figure import Figure

from benchmark.pictures.axes import GROUND, Scene
from benchmark.pictures.sheet import counts, plan, signal_program
from benchmark.pictures.sheet.sheet import (
    GREY,
    HEADING,
    MARGIN,
    PLAN,
    SIDE,
    STRIP,
    Sheet,
    lines,
    plain,
    styled,
)
from benchmark.plumbing.errors import UsageError
from benchmark.plumbing.files import writing
from benchmark.scenario.scenario import Scenario
from benchmark.sumo import ground, network

FORMATS = ("png", "svg")
LINE, TITLE_LINE = 0.15, 0.27  # in


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
    with styled():
        figure = _figure(scenario)
        metadata = {"Date": None, "Title": plain(scenario.title)} if form == "svg" else {}
        with writing(target, "the drawing", remedy="choose another file with --output"):
            target.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(target, format=form, dpi=180, metadata=metadata)


def panels(scenario: Scenario) -> dict[str, str]:
    """The plan and the turning counts as SVG documents of their own, for pages.

    The same scenario gives the same text.

    Raises:
        NetworkError: netconvert refuses the scenario's network.
    """
    scenes = _scenes(scenario)
    plans = Sheet((PLAN + STRIP) * len(scenes), PLAN, GROUND)
    volumes = Sheet(SIDE * len(scenes), SIDE, GROUND)
    with styled():
        for row, scene in enumerate(scenes):
            plan.draw(plans, scene, 0.0, row * (PLAN + STRIP))
            counts.draw(volumes, scene, 0.0, row * SIDE)
        return {"plan": _svg(plans.figure), "counts": _svg(volumes.figure)}


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def _scenes(scenario: Scenario) -> list[Scene]:
    """Each junction, with the ground of all of them."""
    built = network.build_network(scenario)
    around = ground.surroundings(built)
    return [Scene(scenario, junction, around) for junction in built.junctions.values()]


def _figure(scenario: Scenario) -> Figure:
    """The title, a row of panels for each junction, and the footer."""
    scenes = _scenes(scenario)
    title = lines(scenario.title, width=88, most=3)
    foot = _footer(scenario)
    tops = [MARGIN + TITLE_LINE * len(title) + 0.1]
    for _ in scenes:
        tops.append(tops[-1] + HEADING + PLAN + STRIP)
    sheet = Sheet(tops[-1] + 0.15 + LINE * len(foot) + 0.2)
    sheet.text(MARGIN, MARGIN, "\n".join(title), fontsize=14, fontweight="bold", linespacing=1.25)
    for scene, top in zip(scenes, tops, strict=False):
        name = f" of {plain(scene.intersection.id)}" if len(scenes) > 1 else ""
        plan.panel(sheet, scene, top, name)
        counts.panel(sheet, scene, top)
        signal_program.panel(sheet, scene, top + HEADING + SIDE + 0.3)
    words = "\n".join(foot)
    sheet.text(MARGIN, tops[-1] + 0.15, words, fontsize=7, color=GREY, linespacing=1.3)
    return sheet.figure


def _footer(scenario: Scenario) -> list[str]:
    period = scenario.peak
    total = sum(period.counts(name).total for name in scenario.approaches.names())
    words = f"Total demand: {total:.0f} veh/h in the peak period."
    if scenario.sources:
        words += f" Sources: {'; '.join(scenario.sources).rstrip('.')}."
    return lines(words, width=205, most=4)

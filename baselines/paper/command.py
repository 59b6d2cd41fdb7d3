"""The command ``rightofway paper``."""

from pathlib import Path
from typing import Annotated

import typer

from benchmark.commands import console
from benchmark.commands.options import Records
from benchmark.plumbing import files
from benchmark.plumbing.errors import RightOfWayError, UsageError

EXAMPLE, SEEDS = "334", (1, 2, 3)  # where and in which episodes a lane change is looked for


def paper(
    records: Records = Path("results"),
    out: Annotated[Path, typer.Option(help="Folder for PAPER.md and figures.")] = Path(
        "results/paper"
    ),
    lane_change: Annotated[
        bool, typer.Option(help="Also run episodes for the example of a lane change; needs SUMO.")
    ] = True,
    controller: Annotated[
        str, typer.Option(help="Whose lane change is shown; NAME or NAME?option=value.")
    ] = "hierarchical",
) -> None:
    """Write the paper's table and figures, ours beside its own, from records."""
    from baselines.paper import figures, missing, report
    from baselines.paper.samples import Samples
    from benchmark.records.store import Store
    from benchmark.study.suite import load_suite

    samples = Samples(Store(records, notice=console.notice).read())
    if not samples.controllers:
        raise UsageError(
            f"{records}: no records of the paper's intersections; make some with "
            f"`rightofway run paper --out {records}`"
        )
    suite = load_suite(missing.SUITE)
    remedy = "choose another folder with --out"
    with files.writing(out, remedy=remedy):
        out.mkdir(parents=True, exist_ok=True)
        (out / report.LANE_CHANGE).unlink(missing_ok=True)
    example = _example(controller, out / report.LANE_CHANGE) if lane_change else ""
    pictures = figures.write(samples, out)
    with files.writing(target := out / "PAPER.md", remedy=remedy):
        text = report.report(samples, suite, records, pictures, example)
        target.write_text(text, encoding="utf-8")
    for gap in missing.gaps(samples, suite):
        console.notice(f"{gap.controller}: {gap.words}")
    typer.echo(str(target))


def _example(controller: str, target: Path) -> str:
    """The section on a lane change, and its drawing; what went wrong where it cannot be had."""
    from baselines.paper import lane_change, lane_change_drawing
    from baselines.paper.published import FIGURE_RATE
    from baselines.paper.report import example
    from benchmark.scenario import catalogue
    from benchmark.study.episode import Episode

    scenario = catalogue.find_scenario(EXAMPLE)
    try:
        example_run = lane_change.first_asked_for(
            Episode(scenario, controller, FIGURE_RATE, seed) for seed in SEEDS
        )
    except RightOfWayError as error:
        console.notice(f"no example of a lane change: {error}")
        return example(f"No example: {error}", drawn=False)
    if example_run is None:
        seeds = ", ".join(map(str, SEEDS))
        return example(
            f"None: under `{controller}` at {scenario.name}, {100 * FIGURE_RATE:g} % RVs, seeds "
            f"{seeds}, no RV left a lane with another RV on it for one without.",
            drawn=False,
        )
    episode, changes = example_run
    lane_change_drawing.draw(scenario, lane_change.longest(changes), target)
    return example(lane_change.words(episode, changes), drawn=True)

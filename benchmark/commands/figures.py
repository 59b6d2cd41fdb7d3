"""The command ``rightofway figures``."""

from pathlib import Path
from typing import Annotated

import typer

from benchmark.commands import console
from benchmark.commands.options import Records, rate_option
from benchmark.plumbing import files
from benchmark.plumbing.errors import UsageError


def draw_figures(
    records: Records = Path("out"),
    out: Annotated[
        Path | None, typer.Option(help="Folder for the figures; default: figures in the results.")
    ] = None,
    form: Annotated[str, typer.Option("--format", help="png, svg or pdf.")] = "png",
    only: Annotated[
        list[str] | None, typer.Option(help="Repeatable; this figure alone, such as waiting.")
    ] = None,
    scenario: Annotated[
        list[str] | None, typer.Option(help="Repeatable; default: the first eight of them.")
    ] = None,
    controller: Annotated[
        list[str] | None, typer.Option(help="Repeatable; default: the five that wait least.")
    ] = None,
    rate: Annotated[
        list[float] | None,
        rate_option(words="Repeatable; default: all that were run."),
    ] = None,
    at: Annotated[
        float | None,
        rate_option(
            words="The rate of figures that show one; default: that nearest to 0.4.",
        ),
    ] = None,
    training: Annotated[
        list[Path] | None,
        typer.Option(help="Repeatable; folders of training runs, for their curves."),
    ] = None,
) -> None:
    """Draw the figures of a results folder, for print and for the colour-blind; needs no SUMO."""
    from benchmark.plumbing.messages import nearest
    from benchmark.records.store import Store
    from benchmark.reports.plots import gallery, style
    from benchmark.reports.plots import training as curves
    from benchmark.reports.plots.data import Data, Wish

    file_format = next((known for known in style.FORMATS if known == form), None)
    if file_format is None:
        raise UsageError(f'--format "{form}": expected {", ".join(style.FORMATS)}')
    for name in only or ():
        if name not in gallery.NAMES:
            raise UsageError(f'--only "{name}": no such figure{nearest(name, gallery.NAMES)}')
    logs = curves.training_logs(training or [])
    store = Store(records, notice=console.notice)
    wish = Wish(scenario or (), controller or (), rate or (), at)
    data = Data(store.table(), store.records_of, wish)
    for thing, count, asked in (
        ("scenario", data.scenarios_left_out, scenario),
        ("controller", data.controllers_left_out, controller),
    ):
        if count and not asked:
            console.notice(f"{count} more {thing}s are left out; --{thing} chooses")
    target = out or records / "figures"
    with files.writing(target):
        target.mkdir(parents=True, exist_ok=True)
    written = []
    for kind, path in gallery.write_figures(data, logs, target, file_format, only or ()):
        if path is None:
            console.notice(f"{kind.name}: nothing to draw; {kind.lacks}")
        else:
            written.append((kind, path))
            console.say(str(path))
    if not written:
        raise UsageError(f"{records}: nothing to draw")
    if not only:
        gallery.write_gallery(data, written, target)

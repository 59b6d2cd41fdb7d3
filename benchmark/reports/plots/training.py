"""Training curves, from the logs that ``rightofway train`` leaves."""

import csv
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from benchmark.plumbing.errors import UsageError
from benchmark.reports.plots import style

CURVES = {
    "rollout/waiting": "waiting while training [s]",
    "validation/waiting": "waiting in validation [s]",
    "rollout/reward": "mean reward of a decision",
    "rollout/gridlocked": "episodes that jammed",
}


def training_logs(folders: Sequence[Path]) -> dict[str, Path]:
    """The logs below folders, by the name of the run that left them.

    Raises:
        UsageError: a folder holds none.
    """
    logs = {}
    for folder in folders:
        here = sorted(folder.rglob("logs/progress*.csv"))
        if not here:
            raise UsageError(
                f"{folder}: no logs of a training run (logs/progress.csv); "
                "`rightofway train` writes them"
            )
        for path in here:
            run = path.parent.parent
            name = run.name if run != folder or len(here) == 1 else folder.name
            more = path.stem.removeprefix("progress")
            logs[f"{name}{more}"] = path
    return logs


def training_curves(logs: dict[str, Path]) -> Figure | None:
    """What each run logged, round by round."""
    runs = {name: _columns(path) for name, path in logs.items()}
    logged = set().union(*runs.values())
    known = {key: title for key, title in CURVES.items() if key in logged}
    if not known:
        return None
    figure, panels = style.panels([*known.values()])
    for place, run in enumerate(runs.values()):
        for key, title in known.items():
            if points := run.get(key):
                looks = style.looks(place) | {"markersize": 3, "linewidth": 1.1}
                panels[title].plot(*zip(*points, strict=True), **looks)
    figure.supxlabel("round", fontsize=9)
    style.legend(figure, [style.line(place) for place in range(len(runs))], [*runs])
    return figure


def _columns(path: Path) -> dict[str, list[tuple[int, float]]]:
    """Round and value of each column, where it has one.

    Raises:
        UsageError: it is no such log.
    """
    columns: dict[str, list[tuple[int, float]]] = {}
    try:
        with path.open(newline="") as file:
            for number, row in enumerate(csv.DictReader(file), start=1):
                for key, value in row.items():
                    if value:
                        columns.setdefault(key, []).append((number, float(value)))
    except (OSError, ValueError, TypeError, csv.Error) as error:
        raise UsageError(f"{path}: not a log of a training run: {error}") from error
    return columns

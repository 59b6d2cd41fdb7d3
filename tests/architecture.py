"""Draws the rooms of the library and who imports whom: ``make architecture``.

Rooms stand on a diagonal, a floor a band. An arrow leaves a room to the right and comes down into
the room that it imports; where it turns stands the number of imports. An arrow that ran back up
would stand below the diagonal.
"""

import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import grimp
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "architecture.svg"
LIBRARY = "benchmark"
COLOUR = "tab:blue"

Arrow = tuple[str, str]
"""A room, and one that it imports."""


def floors() -> list[list[str]]:
    """The rooms by floor, from the door down, as import-linter holds them."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    return [floor.split(" | ") for floor in layers]


def arrows() -> Counter[Arrow]:
    """How many imports each arrow stands for."""
    graph = grimp.build_graph(LIBRARY, cache_dir=None)
    pairs = (
        (_room(importer), _room(imported))
        for importer in graph.modules
        for imported in graph.find_modules_directly_imported_by(importer)
    )
    return Counter((importer, imported) for importer, imported in pairs if importer != imported)


def draw(floors: Sequence[Sequence[str]], arrows: Mapping[Arrow, int], path: Path) -> None:
    """Write the picture as SVG; equal arguments and versions give equal bytes."""
    rooms = [room for floor in floors for room in floor]
    inside = {arrow: count for arrow, count in arrows.items() if set(arrow) <= set(rooms)}
    with rc_context({"svg.hashsalt": LIBRARY, "svg.fonttype": "none", "font.size": 9}):
        figure = Figure(figsize=(0.8 * len(rooms), 0.5 * len(rooms)), layout="constrained")
        axes = figure.subplots()
        axes.set(xlim=(-0.55, len(rooms) - 0.45), ylim=(len(rooms) - 0.5, -0.5))
        axes.axis("off")
        _draw_floors(axes, floors)
        for index, room in enumerate(rooms):
            box = {"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": "black"}
            axes.text(index, index, room, ha="center", va="center", bbox=box, gid=room)
            above = [rooms.index(importer) for importer, imported in inside if imported == room]
            below = [rooms.index(imported) for importer, imported in inside if importer == room]
            if below:
                axes.hlines(index, index, max(below), color=COLOUR, lw=0.8, zorder=1)
            if above:
                _draw_entry(axes, index, min(above))
        for arrow, imports in sorted(inside.items()):
            importer, imported = map(rooms.index, arrow)
            axes.plot(imported, importer, "o", color="#dbe9f6", markersize=13, zorder=2)
            label = {"ha": "center", "va": "center", "fontsize": 7, "gid": "-".join(arrow)}
            axes.text(imported, importer, str(imports), **label)
        figure.savefig(path, format="svg", metadata={"Date": None, "Creator": None})


def _draw_floors(axes: Axes, floors: Sequence[Sequence[str]]) -> None:
    top = -0.5
    for number, floor in enumerate(floors):
        axes.axhspan(top, top + len(floor), color="0.93" if number % 2 else "1", zorder=0)
        top += len(floor)


def _draw_entry(axes: Axes, room: int, highest: int) -> None:
    """The line down into a room, from the highest that imports it."""
    style = {"arrowstyle": "->", "color": COLOUR, "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (room, room - 0.3), (room, highest), arrowprops=style, zorder=1)


def _room(module: str) -> str:
    """The package right below the library that a module lies in."""
    return module.split(".")[1] if "." in module else module


if __name__ == "__main__":
    draw(floors(), arrows(), PICTURE)

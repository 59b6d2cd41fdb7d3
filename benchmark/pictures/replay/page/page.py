"""Trajectories -> one page that plays them: everything is in it, and it may ask for nothing."""

import base64
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import msgspec
from markupsafe import Markup

from benchmark import __version__
from benchmark.pictures.replay.document import document
from benchmark.pictures.replay.trajectories import Trajectories
from benchmark.plumbing import files
from benchmark.plumbing.errors import RightOfWayError, TrajectoryError, UsageError
from benchmark.records.record import Record
from benchmark.reports import web
from benchmark.reports.words import percent

SCRIPTS = (
    "unpack",
    "motion",
    "camera",
    "ground",
    "traffic",
    "stage",
    "figures",
    "timeline",
    "moment",
    "player",
    "gestures",
    "controls",
    "main",
)
MOST = 4  # episodes side by side; more are too small to see
SPEEDS = ("0.5", "1", "2", "4", "8", "16", "32")
HEAD = 65536  # characters in which a page says what it shows


@dataclass(frozen=True)
class Shown:
    """An episode as the page names it."""

    controller: str
    rate: str
    seed: int


def page(kept: Sequence[Trajectories]) -> str:
    """The page of one episode, or of several of the same traffic side by side.

    The same trajectories give the same bytes.

    Raises:
        TrajectoryError: there are none, too many, or they are not of the same traffic.
    """
    check_together([episode.record for episode in kept])
    first = kept[0]
    style, theme, script = _style(), web.asset("theme.js"), _script()
    return (
        web.environment(__package__, ".")
        .get_template("replay.html")
        .render(
            title=_title(kept),
            scenario=first.record.scenario,
            heading=first.title,
            shown=[_shown(episode.record) for episode in kept],
            identities=[episode.record.identity or "" for episode in kept],
            movements=_movements(first),
            several=len(first.ground.junctions) > 1,
            last=first.steps - 1,
            speeds=SPEEDS,
            vehicles=list(dict.fromkeys(name for episode in kept for name in episode.vehicles.id)),
            documents=[_embedded(episode) for episode in kept],
            policy=_policy(style, theme, script),
            style=Markup(style),  # noqa: S704 - our own files
            theme=Markup(theme),  # noqa: S704
            script=Markup(script),  # noqa: S704
            icon=_address(web.asset("icon.svg"), "image/svg+xml"),
            version=__version__,
        )
    )


def write(
    kept: Sequence[Trajectories], path: Path, kind: type[RightOfWayError] = UsageError
) -> Path:
    """Write the page into a file, whole or not at all.

    Args:
        kept: what it shows.
        path: where; its folder is made where it is missing.
        kind: the error to raise.

    Raises:
        RightOfWayError: of that kind; the disk refuses.
    """
    text = page(kept)
    with files.writing(path, "the replay", kind):
        path.parent.mkdir(parents=True, exist_ok=True)
        with files.replaced(path) as draft:
            draft.write_text(text, encoding="utf-8", errors="replace")
    return path


def check_together(records: Sequence[Record]) -> None:
    """Make sure that episodes can be shown side by side.

    Raises:
        TrajectoryError: they cannot.
    """
    if not 1 <= len(records) <= MOST:
        raise TrajectoryError(
            f"{len(records)} episodes for one page; give one to {MOST}, more are too small to see"
        )
    first = records[0]
    for other in records[1:]:
        if (other.scenario_hash, other.seed) != (first.scenario_hash, first.seed):
            raise TrajectoryError(
                f"{_name(first)} and {_name(other)} are not the same traffic; episodes stand side "
                "by side where they share scenario and seed"
            )


def shows(head: str) -> list[str]:
    """The identities of the episodes that a page shows, as its first ``HEAD`` characters say."""
    return re.findall(r'<meta name="rightofway:identity" content="([^"]*)">', head)


def _name(record: Record) -> str:
    return f"{record.controller} on {record.scenario}, seed {record.seed}"


def _title(kept: Sequence[Trajectories]) -> str:
    return f"{kept[0].title}: {' and '.join(episode.record.controller for episode in kept)}"


def _shown(record: Record) -> Shown:
    rate = "no RVs" if record.rate is None else f"{percent(record.rate)} RVs"
    return Shown(record.controller, rate, record.seed)


def _movements(kept: Trajectories) -> list[tuple[str, str]]:
    """Each movement's place among the curves and its name."""
    several = len(kept.ground.junctions) > 1
    return [
        (f"{index}.{row}", f"{junction.id} {movement.id}" if several else movement.id)
        for index, junction in enumerate(kept.ground.junctions)
        for row, movement in enumerate(junction.movements)
    ]


def _embedded(kept: Trajectories) -> Markup:
    """A document as JSON in which no tag can begin."""
    text = msgspec.json.encode(document(kept)).decode()
    return Markup(text.replace("<", "\\u003c"))  # noqa: S704


def _text(name: str) -> str:
    return (resources.files(__package__) / name).read_text(encoding="utf-8")


def _style() -> str:
    return f"\n{web.asset('theme.css')}{_text('replay.css')}"


def _script() -> str:
    """All scripts as one, whose names are nobody else's."""
    parts = "\n".join(_text(f"{name}.js") for name in SCRIPTS)
    return f'\n(() => {{\n"use strict";\n{parts}}})();\n'


def _policy(style: str, *scripts: str) -> str:
    """A content security policy: this page's own style and scripts, and nothing else at all."""
    ours = " ".join(map(_hash, scripts))
    return (
        f"default-src 'none'; script-src {ours}; style-src {_hash(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _address(text: str, kind: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(text.encode()).decode()}"

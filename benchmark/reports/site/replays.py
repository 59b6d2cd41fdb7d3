"""Replays that lie in a results folder, and whom they show."""

from collections.abc import Iterator
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

FOLDER = "replays"
HEAD = 65536  # characters in which a page says what it shows


@dataclass(frozen=True)
class ReplayPage:
    """A page that plays one episode, or several side by side."""

    path: Path
    title: str
    scenarios: tuple[str, ...] = ()
    controllers: tuple[str, ...] = ()
    episodes: tuple[str, ...] = ()  # rate and seed of each, as in "60 % RVs, seed 3"

    @property
    def words(self) -> str:
        """The title, and the rate and seed where all episodes share them."""
        told = dict.fromkeys(self.episodes)
        return f"{self.title} ({'; '.join(told)})" if told else self.title

    @property
    def address(self) -> str:
        """Where the site has it."""
        return f"{FOLDER}/{self.path.name}"


def replays_in(results: Path) -> list[ReplayPage]:
    """The replays of a results folder, by name: ``replays/*.html``.

    A page says whom it shows in its head, in one or more
    ``<meta name="rightofway:scenario" content="...">``, ``<meta name="rightofway:controller">`` and
    ``<meta name="rightofway:episode">``, its rate and seed.
    """
    return list(_replays(results / FOLDER))


def _replays(folder: Path) -> Iterator[ReplayPage]:
    for path in sorted(folder.glob("*.html")):
        with path.open(encoding="utf-8", errors="replace") as file:
            head = _Head()
            head.feed(file.read(HEAD))
        yield ReplayPage(
            path,
            " ".join("".join(head.title).split()) or path.stem,
            tuple(head.facts["rightofway:scenario"]),
            tuple(head.facts["rightofway:controller"]),
            tuple(head.facts["rightofway:episode"]),
        )


class _Head(HTMLParser):
    """Reads the title and what a replay says of itself."""

    def __init__(self) -> None:
        super().__init__()
        self.title: list[str] = []
        self.facts: dict[str, list[str]] = {
            f"rightofway:{name}": [] for name in ("scenario", "controller", "episode")
        }
        self._in_title = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._in_title = tag == "title" and not self.title
        given = dict(attrs)
        if tag == "meta" and given.get("name") in self.facts:
            self.facts[given["name"] or ""].append(given.get("content") or "")

    def handle_endtag(self, tag: str) -> None:
        self._in_title = False

    def handle_data(self, data: str) -> None:
        if self._in_title:
            self.title.append(data)

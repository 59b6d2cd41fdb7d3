"""Where each page lies: file names from names that may hold anything."""

import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass

LONGEST = 80  # of a slug [characters]


def slugs(names: Iterable[str]) -> dict[str, str]:
    """A file name's stem for each name: short, plain, and no two alike on any file system.

    Names whose plain forms meet get the start of their hash, so that what a page is called does
    not depend on the order of names.
    """
    every = sorted(set(names))
    plain = {name: _plain(name) for name in every}
    taken = list(plain.values())
    return {
        name: slug if slug and taken.count(slug) == 1 else f"{slug or 'page'}-{_digest(name)}"
        for name, slug in plain.items()
    }


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9._-]+", "-", name.lower()).strip("-.")[:LONGEST]


def _digest(name: str) -> str:
    return hashlib.sha256(name.encode(errors="replace")).hexdigest()[:8]


@dataclass(frozen=True)
class Addresses:
    """The paths of pages and files below the site's folder."""

    scenarios: dict[str, str]
    controllers: dict[str, str]

    @classmethod
    def of(cls, scenarios: Iterable[str], controllers: Iterable[str]) -> "Addresses":
        """The addresses of a site with these scenarios and controllers."""
        return cls(slugs(scenarios), slugs(controllers))

    def scenario(self, name: str) -> str:
        """The page of a scenario."""
        return f"scenarios/{self.scenarios[name]}.html"

    def controller(self, name: str) -> str:
        """The page of a controller."""
        return f"controllers/{self.controllers[name]}.html"

    def pair(self, controller: str, other: str) -> str:
        """The page that compares two controllers, whichever comes first."""
        first, second = sorted((controller, other))
        return f"pairs/{self.controllers[first]}--{self.controllers[second]}.html"

    def table(self, scenario: str) -> str:
        """The download of a scenario's rows."""
        return f"data/{self.scenarios[scenario]}.csv"

    def citation(self, scenario: str) -> str:
        """The download of a scenario's BibTeX entry."""
        return f"data/{self.scenarios[scenario]}.bib"

    def drawing(self, scenario: str, panel: str) -> str:
        """A panel of a scenario's drawing."""
        return f"drawings/{self.scenarios[scenario]}-{panel}.svg"

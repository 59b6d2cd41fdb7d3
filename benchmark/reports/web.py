"""What pages of the site and of replays share: the environment of templates, and the theme."""

from importlib.resources import files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jinja2 import Environment


def environment(package: str, folder: str = "templates") -> "Environment":
    """An environment in which everything is escaped and unknown names are refused.

    Args:
        package: whose templates it reads.
        folder: where they lie in it; "." for the package's own folder.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader(package, folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def asset(name: str) -> str:
    """The text of a file that all pages share, such as ``theme.css``."""
    return (files("benchmark.reports.site") / "static" / name).read_text(encoding="utf-8")

"""What is known of a controller apart from its records: its class, and its model card."""

import inspect
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from markupsafe import Markup

from benchmark.control import plugins
from benchmark.plumbing.errors import ControllerError

if TYPE_CHECKING:
    from markdown_it.token import Token

NOTHING = Markup()
CARD = "README.md"
FRAME = '<div class="scroll" role="group" aria-label="Table" tabindex="0">'
SECTION = re.compile(r"^(?:Args|Attributes|Raises|Returns|Examples?):$", re.MULTILINE)


@dataclass(frozen=True)
class Description:
    """A controller in its own words; empty where it is not installed."""

    brief: str = ""  # one line
    words: Markup = NOTHING
    card: Markup = NOTHING


def describe(reference: str) -> Description:
    """The docstring and the model card of an installed controller.

    The card is the ``README.md`` beside it, if it has a package of its own. One that a record took
    from a file or a module is not loaded: to show records is not to run code that they name.
    """
    name = reference.partition("?")[0]
    if name not in plugins.discovered():
        return Description()
    try:
        kind = plugins.load_class(name)
    except ControllerError:
        return Description()
    return Description(plugins.description(kind), render(_prose(kind)), _card(kind))


def _prose(kind: type) -> str:
    """A class's docstring as far as it is written for those who do not call it."""
    return re.split(SECTION, inspect.cleandoc(kind.__doc__ or ""), maxsplit=1)[0]


def _card(kind: type) -> Markup:
    """The README of the package that holds a class."""
    if "." not in kind.__module__:
        return NOTHING
    try:
        text = Path(inspect.getfile(kind)).with_name(CARD).read_text("utf-8")
    except (OSError, TypeError, UnicodeError):
        return NOTHING
    return render(text)


def render(text: str) -> Markup:
    """Markdown as HTML for the middle of a page.

    HTML in it is shown as text. Headings go down two levels, as the page has its own; links to
    files beside it would lead nowhere and become plain text, pictures their descriptions.
    """
    from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = parser.parse(text)
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{min(int(token.tag[1]) + 2, 6)}"
        if token.children:
            token.children = _without_dead_links(token.children)
    html = parser.renderer.render(tokens, parser.options, {})
    html = html.replace("<table>", f"{FRAME}<table>").replace("</table>", "</table></div>")
    return Markup(html)  # noqa: S704 - made by markdown-it


def _without_dead_links(tokens: "list[Token]") -> "list[Token]":
    kept: list[Token] = []
    dead = False
    for token in tokens:
        if token.type == "link_open":
            dead = urlsplit(str(token.attrGet("href") or "")).scheme not in ("http", "https")
        elif token.type == "image":
            token.type, token.tag, token.nesting, token.children = "text", "", 0, None
        if not (dead and token.type in ("link_open", "link_close")):
            kept.append(token)
        if token.type == "link_close":
            dead = False
    return kept

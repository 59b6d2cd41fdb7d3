"""Where commands print: figures to standard output, everything else to standard error."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console


def stdout() -> "Console":
    """The console of what the user asked for."""
    from rich.console import Console

    return Console(highlight=False)


def stderr() -> "Console":
    """The console of notices, progress and errors."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)


def literal(text: str) -> str:
    """Text that prints as it is, whatever brackets it holds."""
    from rich.markup import escape

    return escape(text)


def notice(message: str) -> None:
    """Tell the user what they should know, on standard error."""
    stderr().print(f"[yellow]![/] {literal(message)}", soft_wrap=True)

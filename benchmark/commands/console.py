"""Where commands print: figures to standard output, everything else to standard error."""

from typing import TYPE_CHECKING

import typer

from benchmark.plumbing.plain import shown

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
    """Text that prints as it is, whatever brackets or control characters it holds."""
    from rich.markup import escape

    return escape(shown(text, keep="\n"))


def say(text: str, *, end: str = "\n") -> None:
    """Print what the user asked for; control characters of whoever wrote it show as escapes."""
    typer.echo(shown(text, keep="\n\t") + end, nl=False)


def notice(message: str) -> None:
    """Tell the user what they should know, on standard error."""
    stderr().print(f"[yellow]![/] {literal(message)}", soft_wrap=True)

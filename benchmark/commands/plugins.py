"""Subcommands that plugins bring: functions in the entry-point group ``rightofway.commands``."""

from importlib.metadata import EntryPoint, entry_points
from typing import Any

import typer
from typer.core import TyperGroup

from benchmark.plumbing.errors import UsageError

GROUP = "rightofway.commands"


class Commands(TyperGroup):
    """Own subcommands, and behind them those of plugins, looked up only where they are needed."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of all, the plugins' last."""
        self._add_plugins()
        return super().list_commands(ctx)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The subcommand of a name; None if there is none."""
        if cmd_name not in self.commands:
            self._add_plugins()
        return super().get_command(ctx, cmd_name)

    def _add_plugins(self) -> None:
        for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
            if entry.name not in self.commands:
                self.commands[entry.name] = _command(entry)


def _command(entry: EntryPoint) -> Any:
    """What an entry point holds, as a subcommand; one that cannot be loaded says so when called."""
    single = typer.Typer(add_completion=False, rich_markup_mode=None)
    try:
        function = entry.load()
    except Exception as error:  # a plugin's fault is not to stop the other subcommands
        function = _broken(f"the plugin {entry.value} cannot be loaded: {error}")
    single.command(entry.name)(function)
    return typer.main.get_command(single)


def _broken(words: str) -> Any:
    def broken() -> None:
        raise UsageError(words)

    broken.__doc__ = f"Broken: {words}."
    return broken

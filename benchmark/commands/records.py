"""The commands ``rightofway compact`` and ``rightofway capacity``; they need no SUMO."""

from pathlib import Path

from benchmark.commands import console
from benchmark.commands.options import Records
from benchmark.plumbing.errors import UsageError


def compact(records: Records = Path("out")) -> None:
    """Pack records into Parquet, losslessly: large folders take less room and are read faster.

    All commands read both; new records are JSON Lines again, until the next time.
    """
    from benchmark.records.store import Store

    store = Store(records, notice=console.notice)
    store.require_some()
    before = store.size()
    with store.writing():
        count = store.compact()
    if count:
        console.say(
            f"{count} files packed: {before / 1e6:.1f} MB before, {store.size() / 1e6:.1f} MB now"
        )
    else:
        console.say("all records are packed already")


def show_capacity(records: Records = Path("out")) -> None:
    """Show at which demand intersections jam, from runs of scenarios such as 334@700."""
    from benchmark.records import capacity
    from benchmark.records.store import Store

    curves = capacity.capacity_curves(Store(records, notice=console.notice).table(), console.notice)
    if not curves:
        raise UsageError(
            f"{records}: no records of scenarios at demands of their own; "
            "make some with `rightofway run 334@500 334@700 334@900`"
        )
    console.say(capacity.capacity_markdown(curves), end="")

"""What isolation keeps out on this system, found by trying."""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmark.control.isolation.attempts import PROTECTIONS, THROUGH, Protection
from benchmark.control.isolation.limits import DEFAULT, Limits
from benchmark.control.isolation.remote import Remote

CONTROLLER = "first-come"  # ships with the benchmark; what it decides does not matter


@dataclass(frozen=True)
class Verdict:
    """What came of trying to get past one protection."""

    protection: Protection
    outcomes: Mapping[str, str]  # by attempt, an error or ``THROUGH``

    @property
    def open(self) -> tuple[str, ...]:
        """The attempts that succeeded."""
        return tuple(name for name, outcome in self.outcomes.items() if outcome == THROUGH)


def probe(limits: Limits = DEFAULT) -> list[Verdict]:
    """Try each attempt in one isolated process.

    Raises:
        ControllerError: this system cannot isolate.
        ControllerFailedError: the process ended.
    """
    with tempfile.TemporaryDirectory(prefix="rightofway-victim-") as folder:
        victim = Path(folder).resolve() / "victim"
        for name in ("victim", "spare"):
            (victim.parent / name).write_text("not yours", encoding="ascii")
        (victim.parent / "alias").symlink_to(victim)
        with Remote(CONTROLLER, limits) as remote:
            outcomes = remote.attempt(victim)
    return [
        Verdict(
            protection,
            {name: outcomes[f"{protection.name}: {name}"] for name in protection.attempts},
        )
        for protection in PROTECTIONS
    ]

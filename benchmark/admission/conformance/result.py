"""What a check says."""

from dataclasses import dataclass
from typing import Literal

Status = Literal["passed", "failed", "skipped"]


@dataclass(frozen=True)
class Result:
    """A verdict of one check on one scenario."""

    check: str
    scenario: str  # its name; empty where the check needs none
    status: Status
    words: str  # why, and what to do; what was measured, if it passed


class CheckFailedError(Exception):
    """The controller breaks the contract; carries what an author should know."""


class CheckSkippedError(Exception):
    """The check cannot be made; carries the reason."""

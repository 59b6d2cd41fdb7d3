"""Which modules an isolated controller can import.

A clear message rather than a wall: code that undoes it finds no simulation in its process either.
"""

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

SIMULATION = frozenset({"libsumo", "traci", "sumolib", "sumo"})
ROOMS = ("plumbing", "scenario", "control")
FILES = frozenset(f"benchmark.learning{name}" for name in ("", ".observation", ".weights"))


def is_open(module: str) -> bool:
    """Whether a module of ``benchmark`` is part of what controllers are given."""
    return module.split(".")[1] in ROOMS or module in FILES


class Gate(MetaPathFinder):
    """Refuses the simulation, and of ``benchmark`` all but the rooms that controllers stand on."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Nothing for what may be imported; the finders that follow know it.

        Raises:
            ImportError: it may not.
        """
        root = fullname.partition(".")[0]
        if root in SIMULATION or (root == "benchmark" and not is_open(fullname)):
            raise ImportError(
                f"{fullname} is out of reach for an isolated controller, which meets the "
                "simulation through its contract only; import it where it is needed, outside "
                "the controller's module, or run what you trust with --no-isolate",
                name=fullname,
            )
        return None


def close() -> None:
    """From now on the gate stands before every import in this process."""
    sys.meta_path.insert(0, Gate())

"""How trainers are found: the entry-point group ``rightofway.trainers``."""

from collections.abc import Callable
from importlib.metadata import entry_points

from benchmark.learning.settings import Options
from benchmark.plumbing.errors import ControllerError
from benchmark.plumbing.messages import nearest

GROUP = "rightofway.trainers"

Trainer = Callable[[Options], None]
"""What the group holds."""


def load(name: str) -> Trainer:
    """What trains a controller.

    Raises:
        ControllerError: there is none of that name, or what it needs is not installed.
    """
    known = {entry.name: entry for entry in entry_points(group=GROUP)}
    if (entry := known.get(name)) is None:
        raise ControllerError(f'nothing trains "{name}"{nearest(name, sorted(known))}')
    try:
        trainer: Trainer = entry.load()
    except ModuleNotFoundError as error:
        raise ControllerError(
            f'training "{name}" needs {error.name}, which is not installed; '
            "pip install 'rightofway[train]'"
        ) from error
    return trainer

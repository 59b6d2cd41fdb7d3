"""Which traffic seeds are for what, and what learned weights declare of those they met."""

from collections.abc import Mapping
from typing import Any

from benchmark.records.record import Training

FIRST_TRAINING_SEED = 10_000
"""Traffic seeds: 1 to 1000 are for evaluation, 1001 to 1999 for validation, from here training."""

VALIDATION_SEEDS = range(1001, 2000)
FRESH_SEEDS = range(VALIDATION_SEEDS.stop, FIRST_TRAINING_SEED)
"""For nothing of these, so that whoever verifies a submission may draw from them."""


def declared(notes: Mapping[str, Any]) -> tuple[Training, ...] | None:
    """What weights were trained and validated on, from the notes in their file.

    Returns:
        Training traffic and validation traffic; None where the notes do not say.
    """
    try:
        settings = notes["settings"]
        scenarios = tuple(settings["traffic"]["scenarios"])
        starts = {"traffic": FIRST_TRAINING_SEED, "validation": VALIDATION_SEEDS.start}
        return tuple(
            Training(scenarios=scenarios, first=first, last=first + settings[table]["seeds"] - 1)
            for table, first in starts.items()
        )
    except (KeyError, TypeError):
        return None

"""The law of seeds: which are for what, and what weights or settings declare of those they met."""

from collections.abc import Mapping
from typing import Any

from pydantic import Field

from benchmark.plumbing.models import Entry, Words

FIRST_TRAINING_SEED = 10_000
"""Traffic seeds: 1 to 1000 are for evaluation, 1001 to 1999 for validation, from here training."""

VALIDATION_SEEDS = range(1001, 2000)
UNUSED_SEEDS = range(VALIDATION_SEEDS.stop, FIRST_TRAINING_SEED)
"""For nothing of these; nobody trains on them, so that anybody may try a controller there."""

FRESH_SEEDS = range(2**31, 2**63)
"""Whoever verifies a submission draws from these: too many for anybody to have met them before."""


class Training(Entry):
    """Traffic that weights or settings were fitted to."""

    scenarios: tuple[Words, ...] = Field(description="files, folders or names of scenarios")
    first: int = Field(description="the first traffic seed")
    last: int = Field(description="the last, itself included")

    @property
    def problem(self) -> str | None:
        """Why nobody can have trained on these seeds, or must not; None where nothing does."""
        if not 0 <= self.first <= self.last < FRESH_SEEDS.stop:
            return f"there are no seeds {self.first} to {self.last}"
        for kept in (UNUSED_SEEDS, FRESH_SEEDS):
            if self.first < kept.stop and kept.start <= self.last:
                return (
                    f"the seeds {kept.start} to {kept.stop - 1} are kept for those who verify; "
                    f"train on {FIRST_TRAINING_SEED} to {FRESH_SEEDS.start - 1}"
                )
        return None

    def meets(self, scenario: str, seed: int) -> bool:
        """Whether an episode's traffic was trained on; at which demand makes no difference."""
        if not self.first <= seed <= self.last:
            return False
        name = _without_demand(scenario)
        folder, _, stem = name.rpartition("/")
        for reference in map(_without_demand, self.scenarios):
            above, _, last = reference.removesuffix(".toml").replace("\\", "/").rpartition("/")
            if last == folder or (last == stem and above.rpartition("/")[2] in ("", folder)):
                return True
        return False


def _without_demand(scenario: str) -> str:
    return scenario.rpartition("@")[0] or scenario


def declared_training(notes: Mapping[str, Any]) -> tuple[Training, ...] | None:
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

"""Which traffic seed an environment plays for a seed that a library gives, and what it met."""

from collections.abc import Iterable

from benchmark.control.training import FIRST_TRAINING_SEED, FRESH_SEEDS, Training
from benchmark.plumbing.errors import UsageError

TRAINING_SEEDS = range(FIRST_TRAINING_SEED, FRESH_SEEDS.start)
"""For training; the others are for evaluation, for validation and for those who verify."""


def training_seed(seed: int) -> int:
    """The traffic seed that training plays for any seed.

    A training seed is itself. Any other leads to one: libraries give 1, 2, 3, which are seeds of
    evaluation.
    """
    if seed in TRAINING_SEEDS:
        return seed
    return TRAINING_SEEDS[seed % len(TRAINING_SEEDS)]


def seed_from(value: object) -> int:
    """A seed from outside.

    Raises:
        UsageError: it is none.
    """
    index = getattr(type(value), "__index__", None)
    seed = -1 if index is None or isinstance(value, bool) else int(index(value))
    if not 0 <= seed < FRESH_SEEDS.stop:
        raise UsageError(f"seed {value!r}: expected a whole number from 0 to 2^63 - 1")
    return seed


def declaration(scenario: str, seeds: Iterable[int]) -> tuple[Training, ...]:
    """Seeds that were met on a scenario, as a controller declares them under ``trained_on``."""
    return tuple(
        Training(scenarios=(scenario,), first=first, last=last)
        for first, last in _merged((seed, seed) for seed in sorted(seeds))
    )


def joined(declarations: Iterable[Iterable[Training]]) -> tuple[Training, ...]:
    """One declaration of several environments', with ranges that meet as one.

    Args:
        declarations: ``trained_on`` of each, as ``get_attr("trained_on")`` of a vector environment
            gives them.
    """
    ranges: dict[tuple[str, ...], list[tuple[int, int]]] = {}
    for part in (part for each in declarations for part in each):
        ranges.setdefault(part.scenarios, []).append((part.first, part.last))
    return tuple(
        Training(scenarios=scenarios, first=first, last=last)
        for scenarios, parts in sorted(ranges.items())
        for first, last in _merged(sorted(parts))
    )


def _merged(parts: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    merged: list[tuple[int, int]] = []
    for first, last in parts:
        if merged and first <= merged[-1][1] + 1:
            merged[-1] = (merged[-1][0], max(last, merged[-1][1]))
        else:
            merged.append((first, last))
    return merged

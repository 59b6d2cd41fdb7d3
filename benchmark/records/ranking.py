"""In which order controllers stand: by the places that they have in common."""

from collections import Counter
from collections.abc import Iterable
from statistics import fmean

from benchmark.records.leaderboard import Row

Place = tuple[str, float | None]
"""A scenario and a rate."""


def ranking(rows: Iterable[Row]) -> list[str]:
    """Controllers, least waiting first.

    A low rate waits longer than a high one, so only places that all controllers have are compared.
    Where there is none, those count that most of them have; who lacks one stands behind those who
    have all, and who has no figures stands last.
    """
    waits: dict[str, dict[Place, float]] = {}
    for row in rows:
        places = waits.setdefault(row.controller, {})
        if row.headline:
            places[row.scenario, row.rate] = row.headline.mean
    common = _common([set(places) for places in waits.values() if places])

    def key(name: str) -> tuple[bool, float, str]:
        places = waits[name]
        shared = [places[place] for place in sorted(common & places.keys(), key=repr)]
        means = shared or list(places.values())
        return not common <= places.keys(), fmean(means) if means else float("inf"), name

    return sorted(waits, key=key)


def _common(places: list[set[Place]]) -> set[Place]:
    """The places that all have, else those that most have."""
    if not places:
        return set()
    if shared := set.intersection(*places):
        return shared
    times = Counter(place for those in places for place in those)
    return {place for place, count in times.items() if count == max(times.values())}

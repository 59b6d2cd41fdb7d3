"""How often ``verify`` accuses honest bundles, and finds fitted ones: from the committed records.

Seeds are drawn anew from those of `results/records`, each with all its cells, as submitted ones and
as fresh ones; nothing is simulated. ``python tests/benchmarks/false_alarms.py 500`` takes minutes.
"""

import json
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from random import Random

from benchmark.admission.submission.comparison import Comparison, compared
from benchmark.records.record import Record
from benchmark.records.store import Store

RESULTS = Path(__file__).parents[2] / "results"
SUBMITTED, FRESH = 20, 60
BETTER = (0.0, 0.1, 0.18, 0.2)  # by which share waiting was shorter on the submitted seeds


def drawn(records: Sequence[Record], seeds: Sequence[int], first: int) -> list[Record]:
    """Records of a draw of seeds, numbered from the first."""
    by_seed: dict[int, list[Record]] = {}
    for record in records:
        by_seed.setdefault(record.seed, []).append(record)
    return [
        record.model_copy(update={"seed": first + number})
        for number, seed in enumerate(seeds)
        for record in by_seed[seed]
    ]


def fitted(record: Record, share: float) -> Record:
    """A record with less waiting."""
    junctions = {
        name: junction.model_copy(
            update={"average_waiting_time": (junction.average_waiting_time or 0.0) / (1 + share)}
        )
        for name, junction in record.junctions.items()
    }
    return record.model_copy(update={"junctions": junctions})


def verification(records: Sequence[Record], share: float, random: Random) -> Comparison:
    """One drawn verification of a controller."""
    seeds = sorted({record.seed for record in records})
    old = drawn(records, random.choices(seeds, k=SUBMITTED), 1)
    draws = (drawn(records, random.choices(seeds, k=FRESH), first) for first in (2000, 3000))
    return compared([fitted(record, share) for record in old], draws)


def main(count: int) -> None:
    """Print, for each share, how many of that many verifications object, and how many note."""
    by_controller: dict[str, list[Record]] = {}
    for record in Store(RESULTS).read():
        if "?" not in record.controller:
            by_controller.setdefault(record.controller, []).append(record)
    random, names = Random(1), sorted(by_controller)
    for share in BETTER:
        objected: Counter[str] = Counter()
        noted, finds = 0, {}
        for number in range(count):
            name = names[number % len(names)]
            comparison = verification(by_controller[name], share, random)
            objected[name] += comparison.speaks_against
            noted += comparison.is_suspicious and not comparison.speaks_against
            finds[name] = round(comparison.finds(0 if comparison.is_suspicious else FRESH), 3)
        print(f"{share:.0%} better on its own: {sum(objected.values())} of {count} objected to,")  # noqa: T201 - a command says what it found
        print(f"  {noted} noted; {json.dumps(dict(objected))}; found from {json.dumps(finds)}")  # noqa: T201 - a command says what it found


if __name__ == "__main__":
    main(int(sys.argv[1]))

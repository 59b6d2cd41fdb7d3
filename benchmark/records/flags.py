"""Why a row's waiting time may be low for the wrong reason, or nothing to rely on at all.

A mark compares a row with the signal's on the seeds that both have, and stands where the excess is
significant. A flag needs no signal: what never entered, queues beyond the road, collisions.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from benchmark.records.measures import HEADLINE
from benchmark.records.samples import Cell, Floats
from benchmark.records.statistics import Estimate, estimates

MARKS = {
    "creeps": "time loss is over 10 % above the signal's, although waiting is below it",
    "keeps out": "vehicles wait to enter the network, longer than under the signal by over 5 s",
    "blocks": "throughput is over 10 % below the signal's",
    "crashes": "more collisions than under the signal",
}
"""Why a waiting time below the signal's may be low for the wrong reason."""

EXCESSES: Mapping[str, tuple[str, Callable[[Floats, Floats], Floats]]] = {
    "creeps": ("time_loss", lambda own, signal: own - 1.1 * signal),
    "keeps out": ("insertion_delay", lambda own, signal: own - signal - 5.0),
    "blocks": ("throughput", lambda own, signal: 0.9 * signal - own),
    "crashes": ("collisions", lambda own, signal: own - signal),
}
"""By mark the figure that it looks at, and by how much that is over the limit, by seed."""

KEPT_OUT = 0.05  # of the demand; in a short episode one vehicle is still on its way in
KEPT_OUT_AT_LEAST = 3.0  # veh
DELAYED = 2.0  # s; where the road is free, it is a simulation step


def marks(pairs: Sequence[tuple[Cell, Cell | None]]) -> list[tuple[str, ...]]:
    """The marks of cells, each beside the signal's cell of its place.

    A mark stands where the 95 % interval of the paired excess lies above zero. Without seeds that
    both have there is none.
    """
    suspects = [(place, mark, excess) for place, mark, excess in _suspects(pairs)]
    certain = estimates([excess for _, _, excess in suspects])
    deserved: list[tuple[str, ...]] = [()] * len(pairs)
    for (place, mark, _), estimate in zip(suspects, certain, strict=True):
        if estimate.bounds[0] > 0:
            deserved[place] = (*deserved[place], mark)
    return deserved


def _suspects(pairs: Sequence[tuple[Cell, Cell | None]]) -> Iterator[tuple[int, str, Floats]]:
    """Where the mean excess is above zero although waiting is below the signal's."""
    for place, (cell, signal) in enumerate(pairs):
        if signal is None or signal is cell:
            continue
        own, beside = cell.sample.paired(signal.sample, HEADLINE.key)
        if not len(own) or np.mean(own - beside) >= 0:
            continue
        for mark, (key, excess_of) in EXCESSES.items():
            excess = excess_of(*cell.source(key).paired(signal.source(key), key))
            if len(excess) and np.mean(excess) > 0:
                yield place, mark, excess


def flags(figures: Mapping[str, Estimate]) -> Iterator[str]:
    """What is wrong with a row whatever the signal does, in words.

    Args:
        figures: the row's, and those of its network.
    """
    never, counted = figures.get("never_inserted"), figures.get("vehicles")
    if never and counted and never.mean >= KEPT_OUT_AT_LEAST:
        share = never.mean / (never.mean + counted.mean)
        if share >= KEPT_OUT:
            yield f"{100 * share:.0f} % of the demand never entered"
    delay = figures.get("insertion_delay")
    if delay and delay.mean > DELAYED:
        yield f"queues beyond the road: vehicles wait {delay.mean:.0f} s to enter"
    crashes = figures.get("collisions")
    if crashes and crashes.bounds[0] > 0:
        yield f"{crashes.mean:.1f} collisions an episode"

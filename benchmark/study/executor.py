"""Who runs many episodes: processes of this machine, or a cluster."""

from collections.abc import Generator, Sequence
from typing import Protocol

from benchmark.records.record import Record
from benchmark.study.episode import Episode


class Executor(Protocol):
    """Runs episodes somewhere: ``pool.LocalPool`` on this machine, or ``cluster`` on many.

    An episode that crashes or takes too long is tried once more (``benchmark.study.outcome``), and
    what befalls it is in its record: ``run`` raises only where nothing can be run any more.
    """

    def run(self, episodes: Sequence[Episode]) -> Generator[tuple[Episode, Record], None, None]:
        """Yield each episode with its record as it ends, starting them in the order given.

        Closing the generator stops at once, in the middle of episodes.
        """
        ...

    def drain(self) -> None:
        """Start no more episodes; ``run`` ends with those under way.

        May be called from a signal's handler.
        """
        ...

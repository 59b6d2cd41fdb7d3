"""A scenario's signal program as a table: when each phase begins and how long its lights last."""

from collections.abc import Iterator
from dataclasses import dataclass

from markupsafe import Markup

from benchmark.scenario.signal import Signal, SignalPhase


@dataclass(frozen=True)
class Step:
    """A phase in its place in the cycle."""

    number: int
    phase: SignalPhase
    start: float  # s
    signal: Signal

    @property
    def bar(self) -> Markup:
        """Green, yellow and all-red over the cycle; hidden from readers, who have the numbers."""
        pieces, begin = [], self.start
        lengths = {
            "green": self.phase.green,
            "yellow": self.signal.yellow,
            "red": self.signal.all_red,
        }
        for light, length in lengths.items():
            x, width = 300 * begin / self.signal.cycle, 300 * length / self.signal.cycle
            pieces.append(
                f'<rect class="{light}" x="{x:.1f}" y="2" width="{width:.1f}" height="10"/>'
            )
            begin += length
        return Markup(  # noqa: S704 - numbers only
            '<svg class="phase" viewBox="0 0 300 14" preserveAspectRatio="none" aria-hidden="true">'
            f'<path class="rail" d="M0 7H300"/>{"".join(pieces)}</svg>'
        )


def program_steps(signal: Signal) -> Iterator[Step]:
    """The phases in their order."""
    start = 0.0
    for number, phase in enumerate(signal.phases, start=1):
        yield Step(number, phase, start, signal)
        start += phase.green + signal.yellow + signal.all_red

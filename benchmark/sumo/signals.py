"""Phases named by movements -> SUMO signal programs, and the switch that ``Phase`` turns."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

from benchmark.plumbing.errors import ScenarioError
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal, SignalPhase
from benchmark.sumo import clearance, tools
from benchmark.sumo.junction import Junction
from benchmark.sumo.network import Network

FOREVER = 1e6  # s


def check_programs(scenario: Scenario, programs: Mapping[str, Signal], network: Network) -> None:
    """Refuse phases that let conflicting movements go without one of them yielding.

    A left may yield to others; streams that both go straight on never share a green. A program
    that a controller brings clears the intersection for as long as the scenario's does.

    Args:
        scenario: with the programs as deployed.
        programs: by junction, where signals rule.
        network: whose junctions they are for.

    Raises:
        ScenarioError: a phase has conflicting greens, or there is too little time between phases.
    """
    for name, signal in programs.items():
        deployed = scenario.junctions[name].signal
        for key in ("yellow", "all_red"):
            here, least = getattr(signal, key), getattr(deployed, key, 0.0)
            if here < least:
                raise ScenarioError(
                    f"{scenario.name}: signal.{key}: {here:g} s; expected at least the "
                    f"{least:g} s of the scenario's own program"
                )
        for problem in _conflicting_greens(scenario, signal, network.junctions[name]):
            raise ScenarioError(f"{scenario.name}: {problem}")


def _conflicting_greens(scenario: Scenario, signal: Signal, junction: Junction) -> Iterator[str]:
    movements = junction.intersection.movements
    for index, phase in enumerate(signal.phases):
        for name in phase.movements:
            for other in sorted(movements[name].conflicts & set(phase.movements)):
                straight = {movements[name].turn, movements[other].turn} == {"C"}
                if straight or not {name, other} & set(phase.permitted):
                    remedy = (
                        f"split the phase, or name a {_crossing(junction)} that yields in permitted"
                    )
                    if movements[name].crosses_oncoming and movements[other].crosses_oncoming:
                        remedy = _of_lefts(scenario, junction, name, other) or remedy
                    yield (
                        f"signal.phases[{index}]: {name} and {other} conflict but are green "
                        f"together; {remedy}"
                    )


def _crossing(junction: Junction) -> str:
    """The word for a turn across oncoming traffic."""
    return "left" if junction.intersection.driving_side == "right" else "right"


def _of_lefts(scenario: Scenario, junction: Junction, name: str, other: str) -> str | None:
    """What helps two crossing turns that a wider box would keep apart."""
    intersection = junction.intersection
    radius = clearance.radius_for(scenario, intersection.id, name, other)
    if radius is None:
        return None
    near = clearance.nearest(intersection.movements[name], intersection.movements[other])
    return (
        f"the paths from {' and '.join(near.lanes)} come within {near.distance:.1f} m of each "
        f"other: widen the box with intersection.radius = {radius:g} (m, of the corners; default "
        "4), or split the phase"
    )


def program_xml(programs: Mapping[str, Signal], network: Network) -> str:
    """The additional file that sets the lights of every ruled junction of a network.

    Args:
        programs: by junction; the lights of the others are dark (every light shows G, as in Wang's
            code).
        network: whose lights are set, if it has any.
    """
    lines = ["<additional>"]
    for light, junction in network.junctions.items() if network.has_lights else ():
        signal = programs.get(light)
        if signal is None:
            dark = "G" * _width(junction)
            lines += _logic(light, "static", "dark", [(dark, FOREVER, None, "dark")])
        elif signal.kind == "fixed":
            fixed = [(s, t, None, n) for s, t, _, n in _timeline(signal, junction)]
            lines += _logic(light, "static", "fixed", fixed)
        else:
            gap = f'<param key="max-gap" value="{signal.maximum_gap:g}"/>'
            lines += _logic(light, "actuated", "actuated", _timeline(signal, junction), gap)
    return "\n".join([*lines, "</additional>", ""])


Row = tuple[str, float, float | None, str]  # state, longest [s], shortest [s], name


def _logic(light: str, kind: str, program: str, rows: Iterable[Row], *parameters: str) -> list[str]:
    phases = []
    for state, longest, shortest, name in rows:
        bounds = f' minDur="{shortest:g}" maxDur="{longest:g}"' if shortest is not None else ""
        duration = longest if shortest is None else shortest
        phases.append(
            f'<phase duration="{duration:g}"{bounds} state="{state}" name={quoteattr(name)}/>'
        )
    head = f'<tlLogic id={quoteattr(light)} type="{kind}" programID="{program}" offset="0">'
    return [head, *parameters, *phases, "</tlLogic>"]


def _timeline(signal: Signal, junction: Junction) -> Iterator[Row]:
    for index, phase in enumerate(signal.phases):
        after = signal.phases[(index + 1) % len(signal.phases)]
        yield green(junction, phase), phase.green, phase.minimum_green, phase.name
        if signal.yellow:
            yield between(junction, phase, after, "y"), signal.yellow, None, "yellow"
        if signal.all_red:
            yield between(junction, phase, after, "r"), signal.all_red, None, "all red"


def _width(junction: Junction) -> int:
    return max(junction.links) + 1


def green(junction: Junction, phase: SignalPhase) -> str:
    """The state of a phase's green, a letter per link in SUMO's alphabet.

    Kerb turns follow US practice, mirrored where traffic drives on the left: with their approach
    green, or in a phase that names them, they go and yield to merging traffic; on red they stop
    first, where they may go at all; from a slip lane they only yield.
    """
    approaches = {junction.intersection.movements[name].approach for name in phase.movements}
    state = ["r"] * _width(junction)
    for index, name in junction.links.items():
        movement = junction.intersection.movements[name]
        if movement.keeps_to_kerb:
            goes = name in junction.yielding or movement.approach in approaches
            state[index] = "g" if goes else "r" if name in junction.waiting else "s"
        elif name in phase.permitted:
            state[index] = "g"
        elif name in phase.movements:
            state[index] = "G"
    return "".join(state)


def between(junction: Junction, before: SignalPhase, after: SignalPhase, ending: str) -> str:
    """The state between two phases: ``ending`` for those that lose their green."""
    return "".join(
        ending if old in "Gg" and new == "r" else ("r" if old == "r" else old)
        for old, new in zip(green(junction, before), green(junction, after), strict=True)
    )


class PhaseSwitch:
    """Shows the phases that a controller commands, with yellow and all-red between them."""

    def __init__(self, signal: Signal, junction: Junction) -> None:
        self._signal, self._junction = signal, junction
        self._phases: Mapping[str, SignalPhase] = {phase.name: phase for phase in signal.phases}
        self._shown: SignalPhase | None = None
        self._next: SignalPhase | None = None
        self._since = 0.0  # s, when the present green or the change began

    @property
    def phase(self) -> str | None:
        """The phase that shows green; None during a change and before the first command."""
        return self._shown.name if self._shown and not self._next else None

    def request(self, name: str | None, time: float) -> str | None:
        """The state to show from now on, or None before the first command.

        Args:
            name: the commanded phase; None keeps what is. A command during a change waits, and
                a green lasts at least the phase's ``minimum_green``.
            time: now [s].
        """
        if self._next is not None and self._shown is not None:
            elapsed = round(time - self._since, 3)  # SUMO's clock counts milliseconds
            if elapsed < self._signal.yellow:
                return self._change("y")
            if elapsed < self._signal.yellow + self._signal.all_red:
                return self._change("r")
            self._show(self._next, time)
        wanted = self._phases.get(name) if name else None
        if self._shown is None:
            if wanted is None:
                return None
            self._show(wanted, time)
        elif (
            wanted is not None
            and wanted is not self._shown
            and round(time - self._since, 3) >= self._shown.minimum_green
        ):
            self._next, self._since = wanted, time
            if self._signal.yellow + self._signal.all_red > 0:
                return self._change("y" if self._signal.yellow else "r")
            self._show(wanted, time)
        assert self._shown is not None
        return green(self._junction, self._shown)

    def _show(self, phase: SignalPhase, time: float) -> None:
        self._shown, self._next, self._since = phase, None, time

    def _change(self, ending: str) -> str:
        assert self._shown is not None
        assert self._next is not None
        return between(self._junction, self._shown, self._next, ending)


def program_file(programs: Mapping[str, Signal], network: Network) -> Path:
    """``program_xml`` as a file in the cache."""
    text = program_xml(programs, network)

    def make(folder: Path) -> None:
        (folder / "program.add.xml").write_text(text)

    return tools.cached("programs", tools.digest(text), make) / "program.add.xml"

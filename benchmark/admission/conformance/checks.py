"""The checks, one function each: it returns what it measured, or raises what is wrong.

Every check but ``declares`` and ``reaches`` is made on each scenario by itself. ``CHECKS`` has them
in the order in which a reader should look at what fails.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import zip_longest

import numpy as np

from benchmark.admission.conformance.elsewhere import in_words
from benchmark.admission.conformance.result import CheckFailedError, CheckSkippedError
from benchmark.admission.conformance.subject import Subject
from benchmark.admission.conformance.watching import Commands, Track, answers, blaming
from benchmark.control import plugins
from benchmark.control.plugins import Plugin
from benchmark.scenario.scenario import Scenario

Check = Callable[[Subject, Scenario], str]

NEVER_RAN = "it does not get through an episode; see runs"


def declares(subject: Subject, scenario: Scenario) -> str:
    """It can be made, describes itself and declares what it needs."""
    with blaming("its constructor"):
        subject.plugin.new()
    if not plugins.description(subject.plugin.kind):
        raise CheckFailedError("the class has no docstring; its first line stands in tables")
    if all(subject.skipped(one) for one in subject.scenarios):
        reasons = "; ".join(f"{one.name}: {subject.skipped(one)}" for one in subject.scenarios)
        raise CheckFailedError(
            f"none of the scenarios suits it, so nothing can be checked ({reasons}); name one that "
            "does with --scenario"
        )
    return subject.plugin.declaration.in_words()


def runs(subject: Subject, scenario: Scenario) -> str:
    """It gets through an episode at the least, a middle and the greatest of its rates."""
    for rate, outcome in subject.elsewhere(scenario).items():
        if outcome.failure:
            raise CheckFailedError(f"{_at(rate)}: {outcome.failure}")
    return f"episodes {', '.join(map(_at, subject.rates))}"


def legal(subject: Subject, scenario: Scenario) -> str:
    """No command is refused."""
    for rate, outcome in subject.elsewhere(scenario).items():
        if outcome.refusals:
            raise CheckFailedError(f"{_at(rate)}: {'; '.join(outcome.refusals)}")
    tracks = subject.live(scenario).tracks
    given = sum(len(commands) for track in tracks for commands in track.commands)
    return f"{given} commands {_at(subject.rate)}, none refused"


def reaches(subject: Subject, scenario: Scenario) -> str:
    """It gets at nothing but what the contract hands over, as far as can be seen."""
    outcomes = [outcome for one in subject.scenarios for outcome in subject.elsewhere(one).values()]
    if found := dict.fromkeys(line for outcome in outcomes for line in outcome.reaches):
        raise CheckFailedError(
            f"{'; '.join(found)}; a controller has what reset and act are given, and no more"
        )
    if not any(subject.ran(one) for one in subject.scenarios):
        raise CheckSkippedError(NEVER_RAN)
    return "no import of the simulation, no process, no connection"


def reads_only(subject: Subject, scenario: Scenario) -> str:
    """It leaves the state and the intersection as they are."""
    for track in subject.live(scenario).tracks:
        if track.changed:
            raise CheckFailedError(
                f"act changed {track.changed}; what it is given is read-only, keep your own copy"
            )
    return "state and intersection as they were"


def repeats(subject: Subject, scenario: Scenario) -> str:
    """Equal seeds and equal traffic give equal commands."""
    for track in subject.live(scenario).tracks:
        _compare(
            answers(subject.plugin.new(), track),
            track,
            "another object, with the same seed and traffic; draw randomness from the seed given "
            "to reset, and keep nothing in the class or module",
        )
    return "another object gave the same commands"


def repeats_elsewhere(subject: Subject, scenario: Scenario) -> str:
    """So they do in another process, where Python orders sets otherwise."""
    tracks = subject.live(scenario).tracks
    found = subject.elsewhere(scenario)[subject.rate].commands
    for track, lines in zip(tracks, found, strict=True):
        own = [in_words(commands) for commands in track.commands]
        for state, one, other in zip(track.states, own, lines, strict=True):
            if one != other:
                raise CheckFailedError(
                    f"at {state.time:g} s another process commanded {_cut(other)} and this one "
                    f"{_cut(one)}; sort what you iterate over, sets above all, and read no clock"
                )
    return "another process gave the same commands"


def forgets(subject: Subject, scenario: Scenario) -> str:
    """After ``reset`` nothing is left of the episodes before."""
    other = subject.other(scenario)
    for track in subject.live(scenario).tracks:
        used = subject.plugin.new()
        for before in other:  # which break off, as an episode may, where nothing comes out even
            answers(used, before.cut(len(before.states) * 7 // 11))
        for _ in range(2):  # after another episode, and after itself
            _compare(
                answers(used, track),
                track,
                "the same object, used for other episodes before; reset must set anew whatever "
                "act changes",
            )
    return "commands after other episodes were the same"


def shares_nothing(subject: Subject, scenario: Scenario) -> str:
    """Two objects, used by turns, do not disturb each other."""
    for track in subject.live(scenario).tracks:
        for elsewhere in subject.other(scenario):
            _compare(
                _beside_another(subject.plugin, track, elsewhere),
                track,
                "an object beside which another one was used; keep nothing in the class or module",
            )
    return "commands beside another object were the same"


def _beside_another(plugin: Plugin, track: Track, elsewhere: Track) -> list[Commands]:
    """What an object commands on a track while another one is on a track of its own."""
    found: list[Commands] = []
    with blaming("beside another object it"):
        one, twin = plugin.new(), plugin.new()
        one.reset(track.intersection, track.seed)
        twin.reset(elsewhere.intersection, elsewhere.seed)
        for state, other in zip_longest(track.states, elsewhere.states):
            if other is not None:
                twin.act(replace(other))
            if state is not None:
                found.append(dict(one.act(replace(state))))
    return found


def decides_in_time(subject: Subject, scenario: Scenario) -> str:
    """It decides faster than the traffic moves: 99 of 100 decisions within a step."""
    tracks = subject.live(scenario).tracks
    milliseconds = 1000 * np.array([one for track in tracks for one in track.seconds])
    counts = [len(state.vehicles) for track in tracks for state in track.states]
    high = float(np.percentile(milliseconds, 99))
    words = (
        f"mean {milliseconds.mean():.3f} ms, p99 {high:.3f} ms with {np.mean(counts):.0f} vehicles "
        f"in the zone, {max(counts)} at most"
    )
    if high > 1000 * scenario.evaluation.step:
        raise CheckFailedError(f"{words}; a step is {1000 * scenario.evaluation.step:g} ms")
    return words


CHECKS: dict[str, Check] = {
    "declares": declares,
    "runs": runs,
    "legal": legal,
    "reaches": reaches,
    "reads-only": reads_only,
    "repeats": repeats,
    "repeats-elsewhere": repeats_elsewhere,
    "forgets": forgets,
    "shares-nothing": shares_nothing,
    "decides-in-time": decides_in_time,
}

ONCE = frozenset({"declares", "reaches"})
"""Checks that are made once, and not on every scenario."""


def applies(name: str, subject: Subject, scenario: Scenario) -> None:
    """See whether a check can be made at all.

    Raises:
        CheckSkippedError: it cannot, and why.
    """
    if name in ONCE:
        return
    if reason := subject.skipped(scenario):
        raise CheckSkippedError(reason)
    if name != "runs" and not subject.ran(scenario):
        raise CheckSkippedError(NEVER_RAN)


def _compare(found: Sequence[Commands], track: Track, who: str) -> None:
    for state, one, wanted in zip(track.states, found, track.commands, strict=True):
        if one != wanted:
            raise CheckFailedError(
                f"at {state.time:g} s it commanded {_cut(in_words(wanted))}, but "
                f"{_cut(in_words(one))} from {who}"
            )


def _cut(words: str, length: int = 60) -> str:
    return (words if len(words) <= length else f"{words[:length]}...") or "nothing"


def _at(rate: float | None) -> str:
    return "without RVs" if rate is None else f"at {100 * rate:g} % RVs"

"""What went wrong in a suite, and the commands that show each failure alone."""

import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.commands import console
from benchmark.control import reference

if TYPE_CHECKING:
    from benchmark.study.episode import Episode
    from benchmark.study.outcome import Outcome

Results = Sequence[tuple["Episode", "Outcome"]]


def report(results: Results, out: Path, time_limit: float) -> None:
    """Name every failure with the command that reproduces it; what was skipped or refused, once.

    Args:
        results: episodes with what became of them.
        out: the results folder.
        time_limit: of an episode [s].
    """
    kinds: dict[tuple[str, Outcome], list[Episode]] = {}
    for episode, outcome in results:
        if outcome.status != "ok":
            kinds.setdefault((episode.label, replace(outcome, refusals=())), []).append(episode)
    for (controller, outcome), episodes in kinds.items():
        count = f"{controller}: {len(episodes)} {outcome.status}"
        if outcome.is_failure:
            commands = [command_of(episode, out, time_limit) for episode in episodes]
            lines = "".join(f"\n    {command}" for command in commands)
            console.notice(f"{count}: {outcome.reason or ''}{lines}")
        else:
            first = episodes[0]
            place = reference.place(first.scenario.name, first.rate, first.seed)
            console.notice(f"{count}, such as {place}: {outcome.reason or ''}")
    refusals = Counter(
        reason.rpartition(" (")[0] for _, outcome in results for reason in outcome.refusals
    )
    for kind, count_of_kind in refusals.items():
        console.notice(f"{kind} (in {count_of_kind} of {len(results)} episodes)")


def command_of(episode: "Episode", out: Path, time_limit: float) -> str:
    """What a user types to run an episode once more, alone."""
    from benchmark.control.isolation.limits import DEFAULT
    from benchmark.scenario import catalogue
    from benchmark.study import outcome

    words = ["rightofway", "run", catalogue.reference_of(episode.scenario)]
    words += ["--controller", episode.controller]
    if episode.rate is not None:
        words += ["--rate", str(episode.rate)]
    words += ["--seed", str(episode.seed)]
    if episode.isolate is not None:
        words += ["--isolate" if episode.isolate else "--no-isolate"]
    usual = asdict(DEFAULT)
    for name, value in asdict(episode.limits).items():
        if value != usual[name]:
            words += [f"--{'answers' if name == 'episode' else name}-limit", str(value)]
    if time_limit != outcome.TIME_LIMIT:
        words += ["--time-limit", str(time_limit)]
    return shlex.join([*words, "--force", "--out", str(out)])

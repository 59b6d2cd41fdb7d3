"""What went wrong in a suite, and the commands that show each failure alone."""

import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from benchmark.commands import console

if TYPE_CHECKING:
    from benchmark.episode import Episode
    from benchmark.record import Record

Results = Sequence[tuple["Episode", "Record"]]


def report(results: Results, out: Path, time_limit: float) -> None:
    """Name every failure with the command that reproduces it; what was skipped or refused, once.

    Args:
        results: episodes with their records.
        out: the results folder.
        time_limit: of an episode [s].
    """
    kinds: dict[tuple[str, str, str], list[tuple[Episode, Record]]] = {}
    for episode, record in results:
        if record.status != "ok":
            key = (record.controller, record.status, record.reason or "")
            kinds.setdefault(key, []).append((episode, record))
    for (controller, status, reason), members in kinds.items():
        episode, record = members[0]
        if record.is_failure:
            commands = "".join(f"\n    {command(one, out, time_limit)}" for one, _ in members)
            console.notice(f"{controller}: {len(members)} {status}: {reason}{commands}")
        else:
            console.notice(
                f"{controller}: {len(members)} {status}, such as {record.scenario} "
                f"rate {record.rate} seed {record.seed}: {reason}"
            )
    refusals = Counter(
        reason.rpartition(" (")[0]
        for _, record in results
        for junction in record.junctions.values()
        for reason in junction.refusals
    )
    for kind, episodes in refusals.items():
        console.notice(f"{kind} (in {episodes} of {len(results)} episodes)")


def command(episode: "Episode", out: Path, time_limit: float) -> str:
    """What a user types to run an episode once more, alone."""
    from benchmark import catalogue, outcome
    from benchmark.isolation.limits import DEFAULT

    words = ["rightofway", "run", catalogue.reference(episode.scenario)]
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

"""Episodes with action logs: run one and keep its commands, or score the commands again."""

import math
from collections.abc import Callable, Iterator
from collections.abc import Set as AbstractSet
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from benchmark.control.guard import Local
from benchmark.plumbing.errors import ActionLogError
from benchmark.plumbing.models import Entry
from benchmark.records.record import Record
from benchmark.scenario import catalogue
from benchmark.study import action_log
from benchmark.study.action_log import ActionLog
from benchmark.study.actions import Recording, spoken
from benchmark.study.episode import Audience, Episode, run_episode, run_opened
from benchmark.world.onlooker import Onlooker

DIGITS = 1e-6  # relative, to which figures are equal on every processor
VARIES = {"wall_time", "versions", "identity"}  # of a record when its commands are scored again


def run_logged(
    episode: Episode,
    folder: Path,
    onlooker: Onlooker | None = None,
    run: Callable[[Episode, Audience], Record] = run_episode,
) -> Record:
    """Run an episode and write its action log; one that does not end well leaves none.

    Args:
        episode: what to run.
        folder: where the log goes.
        onlooker: is told what happens.
        run: runs it.

    Raises:
        RightOfWayError: the scenario cannot be run.
        StoreError: the disk refuses the log.
    """
    recording = Recording()
    record = run(episode, Audience(recording=recording, onlooker=onlooker))
    if record.status == "ok":
        action_log.write_log(folder, recording, record, episode.scenario)
    return record


@dataclass(frozen=True)
class LoggedEpisode(Episode):
    """An episode whose commands are known."""

    log: Path = Path()

    @classmethod
    def of(cls, log: ActionLog) -> "LoggedEpisode":
        """The episode of a log."""
        record = log.record
        return cls(log.scenario, record.controller, record.rate, record.seed, log=log.path)


def rescore(episode: LoggedEpisode, onlooker: Onlooker | None = None) -> Record:
    """Run an episode again, with the commands of its log in place of its controller.

    Args:
        episode: what to run.
        onlooker: is told what happens.

    Raises:
        ActionLogError: the log cannot be read.
        RightOfWayError: the scenario cannot be run.
    """
    log = action_log.read_log(episode.log)
    controller = Local(spoken(log.actions, log.record, log.programs))
    return run_opened(
        lambda: nullcontext(controller),
        episode,
        Audience(onlooker=onlooker),
        source=log.record.controller_from,
    )


def is_shipped(scenario: str) -> bool:
    """Whether a scenario of this name ships, at this or another demand."""
    return (scenario.rpartition("@")[0] or scenario) in catalogue.shipped_scenarios()


def check_scenario(log: ActionLog) -> None:
    """Make sure that a log does not call its own scenario by a shipped one's name.

    Raises:
        ActionLogError: the shipped scenario of that name is another.
    """
    name = log.record.scenario
    if not is_shipped(name):
        return
    (shipped,) = catalogue.find_scenarios([name])
    if shipped.hash != log.record.scenario_hash:
        raise ActionLogError(
            f"{log.path}: of another {name} (hash {log.record.scenario_hash[:12]}) than the one "
            f"that ships ({shipped.hash[:12]}); replay it with Right of Way "
            f"{log.record.versions.rightofway}, which wrote it"
        )


def differences(
    original: Record, again: Record, besides: AbstractSet[str] = frozenset()
) -> list[str]:
    """Where two records of an episode differ, as in ``trips.arrived: 40 there, 41 now``.

    Args:
        original: one of them.
        again: the other.
        besides: fields that may differ besides ``VARIES``.
    """
    first, second = (record.model_dump(exclude=VARIES | besides) for record in (original, again))
    return list(_differing(first, second, ""))


def contradictions(
    earlier: Record, again: Record, besides: AbstractSet[str] = frozenset()
) -> list[str]:
    """As ``differences``, but only of fields that the earlier record's file has, to six digits.

    A learned acceleration differs in its ninth digit from one processor to another, and emissions
    with it.

    Args:
        earlier: as it was read, perhaps written by a version that knew fewer fields.
        again: the same episode, run by today's code.
        besides: fields that may differ besides ``VARIES``.
    """
    first, second = (_said(earlier, record, VARIES | besides) for record in (earlier, again))
    return list(_differing(first, second, "", DIGITS))


def _said(earlier: object, record: object, besides: AbstractSet[str] = frozenset()) -> object:
    if isinstance(earlier, Entry) and isinstance(record, Entry):
        known = earlier.model_fields_set - besides
        names = [name for name in type(earlier).model_fields if name in known]
        return {name: _said(getattr(earlier, name), getattr(record, name)) for name in names}
    if isinstance(earlier, dict) and isinstance(record, dict):
        return {key: _said(earlier.get(key), value) for key, value in record.items()}
    return record


def _differing(first: object, second: object, path: str, tolerance: float = 0.0) -> Iterator[str]:
    if isinstance(first, dict) and isinstance(second, dict):
        for key in [*first, *(second.keys() - first.keys())]:
            inner = f"{path}.{key}".lstrip(".")
            yield from _differing(first.get(key), second.get(key), inner, tolerance)
    elif isinstance(first, float) and isinstance(second, float):
        if not math.isclose(first, second, rel_tol=tolerance):
            yield f"{path}: {_brief(first)} there, {_brief(second)} now"
    elif first != second:
        yield f"{path}: {_brief(first)} there, {_brief(second)} now"


def _brief(value: object) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def versions_differ(original: Record, again: Record) -> str | None:
    """How the versions of two records differ, as in ``sumo 1.27.0 there, 1.28.0 now``."""
    first, second = original.versions.model_dump(), again.versions.model_dump()
    changed = [
        f"{key} {first[key]} there, {second[key]} now" for key in first if first[key] != second[key]
    ]
    return "; ".join(changed) or None

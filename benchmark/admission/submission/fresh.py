"""Runs a submitted controller: on episodes of its bundle, and on seeds that nobody foresaw."""

import contextlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, comb
from pathlib import Path
from random import SystemRandom

from benchmark.admission.submission import code
from benchmark.admission.submission.checks import OWN, Bundle, Check, verdict
from benchmark.admission.submission.code import CodeFiles
from benchmark.admission.submission.comparison import POWER, UNSEEN, compared
from benchmark.admission.submission.manifest import CodeOrigin, Manifest
from benchmark.control import plugins
from benchmark.control import reference as naming
from benchmark.control.isolation.remote import Remote
from benchmark.control.isolation.staging import Brought
from benchmark.control.training import FRESH_SEEDS
from benchmark.plumbing.errors import RightOfWayError
from benchmark.records.record import Record
from benchmark.study import rescoring
from benchmark.study.episode import NOBODY, Audience, Episode, run_episode, run_opened
from benchmark.study.episodes import build_ahead
from benchmark.study.pool import LocalPool

FORGED = 20  # one forged record in so many is to be met
SURE = 0.95
REPEATABLE = ("ok", "failed", "skipped")  # what does not hang on how fast a machine is


@dataclass(frozen=True)
class Runner:
    """How a submitted controller is run, here as where it is submitted: in a process of its own.

    Only controllers that ship with this package run in the simulation's process.
    """

    reference: str
    brought: Brought | None = None  # its code and files

    def __call__(self, episode: Episode, audience: Audience = NOBODY) -> Record:
        """Run an episode under it, in a worker process."""
        mine = replace(episode, controller=self.reference)
        if self.brought is None:
            return run_episode(mine, audience)
        return run_opened(lambda: Remote(self.reference, mine.limits, self.brought), mine, audience)


def runner(folder: Path, manifest: Manifest, *, run_code: bool) -> Runner | str:
    """How to run a submitted controller; why not, in words, if that is impossible.

    An installed controller counts if its code is the submitted code.

    Args:
        folder: of the unpacked bundle.
        manifest: its manifest.
        run_code: whether code that the bundle brings may run.
    """
    options = {key: folder / place for key, place in manifest.options.items()}
    if manifest.code.included and run_code:
        return brought(manifest.name, folder / "code", manifest.code, options)
    name = naming.parse(manifest.name).name
    installed = None
    if name in plugins.discovered():  # never a file or module, which the manifest could choose
        with contextlib.suppress(RightOfWayError):
            installed = code.of(plugins.load_class(name))
    source = manifest.code.source
    if installed is None or installed.sha256 != manifest.code.sha256:
        here = "not installed" if installed is None else "installed with other code"
        lacking = "the bundle brings no code"
        if manifest.code.included:
            lacking = "without --no-run-code what the bundle brings runs"
        return f"{source} is {here}; {lacking}"
    if source.partition(" ")[0] == OWN:
        return Runner(_reference(manifest, options))
    return brought(manifest.name, laid_out(installed, folder), manifest.code, options)


def brought(name: str, place: Path, origin: CodeOrigin, options: Mapping[str, Path] = {}) -> Runner:
    """How to run a controller whose code lies in a folder.

    Args:
        name: with its options.
        place: the folder.
        origin: what the code is.
        options: files, by option.
    """
    parts = naming.parse(name).placed(place)
    return Runner(str(parts), Brought(place, origin.place, origin.source, options))


def laid_out(installed: CodeFiles, folder: Path) -> Path:
    """A folder within another, with copies of a controller's code."""
    place = folder / "code"
    for name, path in installed.files.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, place / name)
    return place


def _reference(manifest: Manifest, files: Mapping[str, Path]) -> str:
    """The controller's reference with files of the bundle in place of files elsewhere."""
    parts = naming.parse(manifest.name)
    options = parts.options() | {key: str(path) for key, path in files.items()}
    return f"{parts.name}?{naming.query(options)}" if options else parts.name


def draws(count: int, bundle: Bundle, wanted: Sequence[int] = ()) -> list[list[int]]:
    """Two draws of seeds that nobody has met, anew each time.

    Args:
        count: seeds of a draw.
        bundle: the submission.
        wanted: seeds that belong to the first draw.
    """
    first = list(dict.fromkeys(wanted))
    taken = {*first, *(record.seed for record in bundle.records)}
    drawn = [
        seed
        for seed in SystemRandom().sample(FRESH_SEEDS, 2 * count + len(taken))
        if seed not in taken
    ]
    more = max(0, count - len(first))
    return [sorted(draw) for draw in ([*first, *drawn[:more]], drawn[more : more + count]) if draw]


def sample(records: Sequence[Record], *, every: bool = False) -> list[Record]:
    """The records that the verifier makes again, drawn anew each time.

    So many that of forged ones, were they one in ``FORGED``, one is met with ``SURE``.
    """
    if every:
        return list(records)
    return SystemRandom().sample(list(records), sample_size(len(records)))


def sample_size(total: int) -> int:
    """How many of all records a sample takes."""
    forged = ceil(total / FORGED)
    chosen = 0
    while comb(total - forged, chosen) > (1 - SURE) * comb(total, chosen):
        chosen += 1
    return chosen


def again(bundle: Bundle, how: Runner, workers: int, *, every: bool = False) -> Check:
    """Run episodes of a bundle under the controller itself: a sample, or every one."""
    scenarios = {log.record.scenario_hash: log.scenario for log in bundle.logs.values()}
    able = [
        record
        for record in bundle.records
        if record.scenario_hash in scenarios and record.status in REPEATABLE
    ]
    drawn = sample(able, every=every)
    episodes = [
        Episode(scenarios[record.scenario_hash], record.controller, record.rate, record.seed)
        for record in drawn
    ]
    records = {record.episode: record for _, record in LocalPool(workers, work=how).run(episodes)}
    problems = [
        f"{naming.place(original.scenario, original.rate, original.seed)}: {problem}"
        for original in drawn
        if (problem := _difference(original, records[original.episode]))
    ]
    whose = "of the bundle" if how.brought else "as installed here"
    return verdict("controller", problems, f"its code {whose} {_sampled(len(drawn), len(able))}")


def _difference(original: Record, made: Record) -> str | None:
    """How a record differs from what the controller makes; None where it does not."""
    if original.status != made.status:
        return made.reason or f"{original.status} there, {made.status} now"
    if original.status != "ok":
        return None
    names = {"controller": original.controller, "controller_from": original.controller_from}
    differing = rescoring.differences(original, made.model_copy(update=names))
    return differing[0] if differing else None


def _sampled(drawn: int, total: int) -> str:
    if drawn == total:
        return f"makes all {total} records again"
    return (
        f"makes {drawn} of {total} records again, drawn at random: one forged record in {FORGED} "
        f"would be met with {SURE:.0%}"
    )


def fresh(bundle: Bundle, how: Runner, drawn: Sequence[Sequence[int]], workers: int) -> Check:
    """Run the controller on other seeds, and see whether it does worse there.

    Args:
        bundle: the submission.
        how: to run its controller.
        drawn: seeds, draw by draw. The second is run only where the first makes suspicious; then
            both together decide.
        workers: processes.
    """
    draws = (_made(bundle, how, seeds, workers) for seeds in drawn)
    comparison = compared(bundle.records, draws)
    words = comparison.words
    if comparison.speaks_against:
        return verdict("fresh seeds", [f"does worse on {words}: fitted to its own?"], "")
    finds = comparison.finds(0 if comparison.is_suspicious else sum(map(len, drawn[1:])))
    told = f"{words}; would find {finds:.0%} longer waiting with {POWER:.0%}"
    if not comparison.has_seeds:
        few = f"{words}; too few seeds to tell: submit more, or draw more with --fresh"
        return Check("fresh seeds", "not checked", few)
    if not comparison.can_tell:
        least = f"{UNSEEN:.0%} must be found: submit more seeds, or draw more with --fresh"
        return Check("fresh seeds", "not checked", f"{told}, which is too little to tell; {least}")
    if comparison.bad or comparison.is_suspicious:
        return Check("fresh seeds", "noted", told)
    return verdict("fresh seeds", [], told)


def _made(bundle: Bundle, how: Runner, seeds: Sequence[int], workers: int) -> list[Record]:
    """The records of each cell of a bundle on other seeds."""
    cells = {(record.scenario, record.rate): record for record in bundle.good}
    episodes = [
        replace(rescoring.LoggedEpisode.of(bundle.logs[record.episode]), seed=seed)
        for record in cells.values()
        for seed in seeds
    ]
    build_ahead(episodes)
    return [record for _, record in LocalPool(workers, work=how).run(episodes)]

"""Verifies a bundle: everything that can be checked, in the order in which it can."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmark.admission.submission import archive, checks, fresh
from benchmark.admission.submission import manifest as manifests
from benchmark.admission.submission.checks import Bundle, Check, verdict
from benchmark.admission.submission.manifest import Manifest
from benchmark.control import reference
from benchmark.plumbing.errors import UsageError
from benchmark.records.record import Record
from benchmark.study import rescoring
from benchmark.study.episodes import build_ahead
from benchmark.study.pool import LocalPool

STEPS = ("files", "weights", "records", "training", "replay", "controller", "fresh seeds")


@dataclass(frozen=True)
class Wishes:
    """What the command line asks of a verification."""

    fresh: int  # seeds of a draw
    seeds: Sequence[int] = ()  # of the first draw
    every: bool = False  # record is made again, not a sample
    run_code: bool = True
    workers: int = 1


@dataclass(frozen=True)
class Verification:
    """What was found of a bundle."""

    manifest: Manifest
    checks: Sequence[Check]
    records: Sequence[Record] = ()  # none unless they were found to hang together

    @property
    def objections(self) -> list[Check]:
        """The checks that speak against it."""
        return [check for check in self.checks if check.verdict == "failed"]

    @property
    def open(self) -> list[Check]:
        """The checks that were not made: with these left, nothing is accepted."""
        return [check for check in self.checks if check.verdict == "not checked"]

    @property
    def is_accepted(self) -> bool:
        """Whether every check was made and none speaks against it."""
        return not (self.objections or self.open)


def verify(path: Path, wishes: Wishes) -> Verification:
    """Check a bundle.

    Raises:
        BundleError: it is none, or not fit to be unpacked.
        UsageError: a wish makes no sense with it.
    """
    with _unpacked(path) as (folder, names):
        manifest = manifests.read(folder)
        done = [checks.files(folder, names, manifest), checks.weights(folder, names, manifest)]
        if any(check.verdict == "failed" for check in done):
            return Verification(manifest, _rest(done))
        check, bundle = checks.opened(folder, manifest)
        done.append(check)
        if bundle is None:
            return Verification(manifest, _rest(done))
        if used := {record.seed for record in bundle.records}.intersection(wishes.seeds):
            raise UsageError(f"--fresh-seed {min(used)}: is among the submitted seeds; give others")
        done += [checks.training(bundle), _replayed(bundle, wishes.workers)]
        if not any(check.verdict == "failed" for check in done):
            done += _with_controller(bundle, wishes)
        return Verification(manifest, _rest(done), bundle.records)


@contextmanager
def _unpacked(path: Path) -> Iterator[tuple[Path, list[str]]]:
    with tempfile.TemporaryDirectory(prefix="rightofway-bundle-") as place:
        folder = Path(place).resolve()
        yield folder, archive.extract(path, folder)


def _rest(done: Sequence[Check]) -> list[Check]:
    """The checks, and that those after the first failure were left."""
    left = [Check(name, "not checked", "after what failed before") for name in STEPS[len(done) :]]
    return [*done, *left]


def _replayed(bundle: Bundle, workers: int) -> Check:
    episodes = [rescoring.LoggedEpisode.of(bundle.logs[record.episode]) for record in bundle.good]
    build_ahead(episodes)
    running = LocalPool(workers, work=rescoring.rescore).run(episodes)
    made = {record.episode: record for _, record in running}
    problems = []
    for original in bundle.good:
        if differing := rescoring.differences(original, made[original.episode]):
            versions = rescoring.versions_differ(original, made[original.episode])
            where = reference.place(original.scenario, original.rate, original.seed)
            problems.append(f"{where}: {differing[0]}{f' ({versions})' if versions else ''}")
    return verdict("replay", problems, f"{len(episodes)} records come out again, bit for bit")


def _with_controller(bundle: Bundle, wishes: Wishes) -> list[Check]:
    how = fresh.runner(bundle.folder, bundle.manifest, run_code=wishes.run_code)
    if isinstance(how, str):
        return [Check(name, "not checked", how) for name in STEPS[5:]]
    done = [fresh.again(bundle, how, wishes.workers, every=wishes.every)]
    drawn = fresh.draws(wishes.fresh, bundle, wishes.seeds)
    if not drawn:
        return [*done, Check("fresh seeds", "not checked", "none were asked for")]
    return [*done, fresh.fresh(bundle, how, drawn, wishes.workers)]

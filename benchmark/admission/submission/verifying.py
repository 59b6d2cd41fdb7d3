"""Verifies a bundle: everything that can be checked, in the order in which it can."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmark.admission.submission import archive, checks, fresh, manifest
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
        return [one for one in self.checks if one.verdict == "failed"]


def verify(path: Path, wishes: Wishes) -> Verification:
    """Check a bundle.

    Raises:
        BundleError: it is none, or not fit to be unpacked.
        UsageError: a wish makes no sense with it.
    """
    with _unpacked(path) as (folder, names):
        said = manifest.read(folder)
        found = [checks.files(folder, names, said), checks.weights(folder, names)]
        if any(one.verdict == "failed" for one in found):
            return Verification(said, _rest(found))
        check, bundle = checks.opened(folder, said)
        found.append(check)
        if bundle is None:
            return Verification(said, _rest(found))
        if used := {one.seed for one in bundle.records}.intersection(wishes.seeds):
            raise UsageError(f"--fresh-seed {min(used)}: is among the submitted seeds; give others")
        found += [checks.training(bundle), _replayed(bundle, wishes.workers)]
        if not any(one.verdict == "failed" for one in found):
            found += _with_controller(bundle, wishes)
        return Verification(said, _rest(found), bundle.records)


@contextmanager
def _unpacked(path: Path) -> Iterator[tuple[Path, list[str]]]:
    with tempfile.TemporaryDirectory(prefix="rightofway-bundle-") as place:
        folder = Path(place).resolve()
        yield folder, archive.extract(path, folder)


def _rest(found: Sequence[Check]) -> list[Check]:
    """The checks, and that those after the first failure were left."""
    left = [Check(name, "not checked", "after what failed before") for name in STEPS[len(found) :]]
    return [*found, *left]


def _replayed(bundle: Bundle, workers: int) -> Check:
    episodes = [rescoring.LoggedEpisode.of(bundle.logs[one.episode]) for one in bundle.good]
    build_ahead(episodes)
    running = LocalPool(workers, work=rescoring.score).run(episodes)
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
    found = [fresh.again(bundle, how, wishes.workers)]
    drawn = fresh.draws(wishes.fresh, bundle, wishes.seeds)
    if not drawn:
        return [*found, Check("fresh seeds", "not checked", "none were asked for")]
    return [*found, fresh.fresh(bundle, how, drawn, wishes.workers)]

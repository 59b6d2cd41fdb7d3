"""Runs a submitted controller: on episodes of its bundle, and on seeds that nobody foresaw."""

import contextlib
import random
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmark import naming, plugins, replay, suite
from benchmark.episode import Episode, run, run_with
from benchmark.errors import RightOfWayError
from benchmark.isolation.remote import Remote
from benchmark.record import Record
from benchmark.submission import code
from benchmark.submission.checks import LAST_SEED, Bundle, Check, verdict
from benchmark.submission.manifest import Manifest

WORSE_RATIO = 1.1  # of waiting on fresh seeds to waiting on the submitted ones
WORSE_CHANCE = 0.01  # of a difference as large, were fresh seeds no different
PERMUTATIONS = 9999


@dataclass(frozen=True)
class Runner:
    """How a submitted controller can be run here.

    Code that a bundle brings runs in a process of its own, as all that nobody here has read.
    """

    reference: str
    path: tuple[str, ...] = ()  # folders of the bundle that it is imported from

    def __call__(self, episode: Episode) -> Record:
        """Run an episode under it, in a worker process."""
        mine = replace(episode, controller=self.reference)
        if not self.path:
            return run(mine)
        return run_with(lambda: Remote(self.reference, mine.limits, self.path), mine)


def runner(folder: Path, said: Manifest, *, run_code: bool) -> Runner | str:
    """How to run a submitted controller; why not, in words, if that is impossible.

    An installed controller counts if its code is the submitted code.

    Args:
        folder: of the unpacked bundle.
        said: its manifest.
        run_code: whether code that the bundle brings may run.
    """
    reference = _reference(folder, said)
    name = naming.parse(said.name).name
    installed = None
    if name in plugins.discovered():  # never a file or module, which the manifest could choose
        with contextlib.suppress(RightOfWayError):
            installed = code.of(plugins.load(name))
    if installed is not None and installed.sha256 == said.code.sha256:
        return Runner(reference)
    here = "not installed" if installed is None else "installed with other code"
    if not said.code.included:
        return f"{said.code.source} is {here}, and the bundle brings no code"
    if not run_code:
        return f"{said.code.source} is {here}; without --no-run-code what the bundle brings runs"
    return Runner(reference, (str(folder / "code"), str(_installed(folder, said))))


def _reference(folder: Path, said: Manifest) -> str:
    """The controller's reference with files of the bundle in place of files elsewhere."""
    parts = naming.parse(said.name)
    options = parts.options()
    name = parts.placed(folder / "code").name
    options |= {key: str(folder / place) for key, place in said.options.items()}
    return f"{name}?{naming.query(options)}" if options else name


def _installed(folder: Path, said: Manifest) -> Path:
    """A folder that makes the bundle's code an installed distribution, for its entry point."""
    name, _, version = said.code.source.partition(" ")
    entry = said.name.partition("?")[0]
    here = folder / "installed"
    if ":" in entry:  # found by its file or module
        here.mkdir()
        return here
    info = here / f"{re.sub('[^A-Za-z0-9]+', '_', name)}-{version}.dist-info"
    info.mkdir(parents=True)
    head = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
    (info / "METADATA").write_text(head, encoding="utf-8")
    lines = f"[{plugins.GROUP}]\n{entry} = {said.code.place}\n"
    (info / "entry_points.txt").write_text(lines, encoding="utf-8")
    return here


def draw(bundle: Bundle, count: int) -> list[int]:
    """Seeds of evaluation that are in no record of a bundle, drawn anew each time."""
    used = {one.seed for one in bundle.records}
    free = [seed for seed in range(1, LAST_SEED + 1) if seed not in used]
    return sorted(random.SystemRandom().sample(free, min(count, len(free))))


def again(bundle: Bundle, how: Runner, workers: int) -> Check:
    """Run the first good episode of each cell under the controller itself."""
    firsts: dict[tuple[str, float | None], Record] = {}
    for one in sorted(bundle.good, key=lambda record: record.seed):
        firsts.setdefault((one.scenario, one.rate), one)
    episodes = [replay.LoggedEpisode.of(bundle.logs[one.episode]) for one in firsts.values()]
    found = {
        (one.scenario, one.rate, one.seed): one
        for one in suite.run_all(episodes, workers, work=how)
    }
    problems = []
    for original in firsts.values():
        made = found[original.scenario, original.rate, original.seed]
        names = {"controller": original.controller, "controller_from": original.controller_from}
        if differing := replay.differences(original, made.model_copy(update=names)):
            where = f"{original.scenario} rate {original.rate} seed {original.seed}"
            problems.append(f"{where}: {made.reason or differing[0]}")
    return verdict("controller", problems, f"makes the same records in {len(firsts)} episodes")


def fresh(bundle: Bundle, how: Runner, seeds: Sequence[int], workers: int) -> Check:
    """Run the controller on other seeds, and see whether it waits longer there."""
    cells: dict[tuple[str, float | None], list[Record]] = {}
    for one in bundle.good:
        cells.setdefault((one.scenario, one.rate), []).append(one)
    episodes = [
        replace(replay.LoggedEpisode.of(bundle.logs[members[0].episode]), seed=seed)
        for members in cells.values()
        for seed in seeds
    ]
    suite.prepare(episodes)
    made = list(suite.run_all(episodes, workers, work=how))
    shown = f"seeds {', '.join(map(str, seeds))}"
    if bad := [one for one in made if one.status != "ok"]:
        one = bad[0]
        problem = f"{len(bad)} of {len(made)} episodes did not end well, such as {one.scenario} "
        problem += f"rate {one.rate} seed {one.seed}: {one.status}: {one.reason}"
        return verdict("fresh seeds", [problem], "")
    pairs = [
        (
            _waits(members),
            _waits([one for one in made if (one.scenario, one.rate) == cell]),
        )
        for cell, members in cells.items()
    ]
    before = float(np.mean([np.mean(submitted) for submitted, _ in pairs]))
    after = float(np.mean([np.mean(found) for _, found in pairs]))
    chance = chance_of(pairs)
    words = f"{shown}: waits {after:.1f} s, on the submitted ones {before:.1f} s (p = {chance:.3f})"
    if after > WORSE_RATIO * before and chance < WORSE_CHANCE:
        return verdict("fresh seeds", [f"waits longer on {words}: fitted to its own?"], "")
    return verdict("fresh seeds", [], words)


def _waits(records: Sequence[Record]) -> npt.NDArray[np.float64]:
    """The average waiting time of each record, over its junctions [s]."""
    return np.array(
        [
            np.mean([junction.average_waiting_time or 0.0 for junction in one.junctions.values()])
            for one in records
        ]
    )


def chance_of(pairs: Sequence[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]]) -> float:
    """How often fresh seeds would wait as much longer by chance (one-sided, p).

    A permutation test on ranks: within each cell it is drawn anew which of the episodes count as
    fresh. The draws are fixed, so equal figures give an equal answer.

    Args:
        pairs: for each cell the waiting times on submitted and on fresh seeds [s].
    """
    draws = np.random.default_rng(0)
    seen, drawn = 0.0, np.zeros(PERMUTATIONS)
    for submitted, found in pairs:
        pooled = np.concatenate([found, submitted])
        ranks = np.array([np.mean(pooled < one) + np.mean(pooled <= one) for one in pooled])
        seen += float(ranks[: len(found)].sum())
        order = draws.random((PERMUTATIONS, len(pooled))).argsort(axis=1)[:, : len(found)]
        drawn += ranks[order].sum(axis=1)
    return float((1 + np.count_nonzero(drawn >= seen - 1e-9)) / (1 + PERMUTATIONS))

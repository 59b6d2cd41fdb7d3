"""Runs a submitted controller: on episodes of its bundle, and on seeds that nobody foresaw."""

import contextlib
import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb
from pathlib import Path
from statistics import fmean

import numpy as np

from benchmark import naming, plugins, replay, suite
from benchmark.episode import Episode, run, run_with
from benchmark.errors import RightOfWayError
from benchmark.isolation.remote import Remote
from benchmark.record import Record
from benchmark.submission import code
from benchmark.submission.checks import LAST_SEED, Bundle, Check, verdict
from benchmark.submission.manifest import Manifest

WORSE_RATIO = 1.1  # of waiting on fresh seeds to waiting on the submitted ones
WORSE_CHANCE = 0.001  # of a difference as large, were fresh seeds no different
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


def draws(bundle: Bundle, count: int) -> list[list[int]]:
    """Two draws of seeds of evaluation that are in no record of a bundle, anew each time."""
    used = {one.seed for one in bundle.records}
    free = [seed for seed in range(1, LAST_SEED + 1) if seed not in used]
    drawn = random.SystemRandom().sample(free, min(2 * count, len(free)))
    return [sorted(some) for some in (drawn[:count], drawn[count:]) if some]


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


def fresh(bundle: Bundle, how: Runner, drawn: Sequence[Sequence[int]], workers: int) -> Check:
    """Run the controller on other seeds, and see whether it waits longer there.

    Args:
        bundle: the submission.
        how: to run its controller.
        drawn: seeds, draw by draw. Seeds that were submitted may happen to be light ones, so the
            controller is objected to only if it waits longer in each draw; the next is run only
            where the one before speaks against it.
        workers: processes.
    """
    found: list[Comparison] = []
    for seeds in drawn:
        made = _made(bundle, how, seeds, workers)
        if bad := [one for one in made if one.status != "ok"]:
            one = bad[0]
            problem = f"{len(bad)} of {len(made)} episodes did not end well, such as {one.scenario}"
            problem += f" rate {one.rate} seed {one.seed}: {one.status}: {one.reason}"
            return verdict("fresh seeds", [problem], "")
        found.append(compared(bundle.good, made))
        if not found[-1].is_worse:
            break
    words = ", and ".join(one.words for one in found)
    if found[-1].is_worse:
        return verdict("fresh seeds", [f"waits longer on {words}: fitted to its own?"], "")
    if not found[-1].can_tell:
        return Check("fresh seeds", "noted", f"{words}: ends well; too few seeds to tell more")
    return verdict("fresh seeds", [], words)


def _made(bundle: Bundle, how: Runner, seeds: Sequence[int], workers: int) -> list[Record]:
    """The records of each cell of a bundle on other seeds."""
    cells = {(one.scenario, one.rate): one for one in bundle.good}
    episodes = [
        replace(replay.LoggedEpisode.of(bundle.logs[one.episode]), seed=seed)
        for one in cells.values()
        for seed in seeds
    ]
    suite.prepare(episodes)
    return list(suite.run_all(episodes, workers, work=how))


@dataclass(frozen=True)
class Comparison:
    """How long a controller waits on fresh seeds, beside those that were submitted."""

    seeds: Sequence[int]  # the fresh ones
    before: float  # s, on the submitted ones
    after: float  # s
    chance: float  # that fresh seeds as good as the submitted ones would wait as much longer
    can_tell: bool  # whether there are seeds enough for a chance that small

    @property
    def is_worse(self) -> bool:
        """Whether it waits longer than chance would have it."""
        return self.after > WORSE_RATIO * self.before and self.chance < WORSE_CHANCE

    @property
    def words(self) -> str:
        """All of it, for the report."""
        return (
            f"seeds {', '.join(map(str, self.seeds))}: waits {self.after:.1f} s, on the submitted "
            f"ones {self.before:.1f} s (p = {self.chance:.3f})"
        )


def compared(submitted: Sequence[Record], made: Sequence[Record]) -> Comparison:
    """Compare records of the same cells on submitted and on fresh seeds."""
    cells: dict[tuple[str, float | None], dict[int, float]] = {}
    for one in (*submitted, *made):
        cells.setdefault((one.scenario, one.rate), {})[one.seed] = _wait(one)
    new = sorted({one.seed for one in made})
    old = {one.seed for one in submitted}
    before, after = (
        fmean(
            fmean(wait for seed, wait in cell.items() if seed in seeds) for cell in cells.values()
        )
        for seeds in (old, new)
    )
    enough = 2 / comb(len(old) + len(new), len(new)) < WORSE_CHANCE
    return Comparison(new, before, after, chance_of([*cells.values()], new), enough)


def _wait(record: Record) -> float:
    """The average waiting time, over its junctions [s]."""
    return fmean(one.average_waiting_time or 0.0 for one in record.junctions.values())


def chance_of(cells: Sequence[Mapping[int, float]], new: Sequence[int]) -> float:
    """How often fresh seeds would wait as much longer by chance (one-sided, p).

    A permutation test on ranks within cells: it is drawn anew which seeds count as fresh, in all
    cells alike, as the traffic of a seed may be light or heavy in several. The draws are fixed, so
    equal figures give an equal answer.

    Args:
        cells: for each cell the waiting times by seed [s].
        new: the seeds that are fresh, at least one; the others were submitted.
    """
    ranks: dict[int, list[float]] = {}
    for cell in cells:
        waits = np.array([*cell.values()])
        for seed, wait in cell.items():
            ranks.setdefault(seed, []).append(float(np.mean(waits < wait) + np.mean(waits <= wait)))
    order = sorted(ranks, key=lambda seed: (seed not in new, seed))
    means = np.array([fmean(ranks[seed]) for seed in order])
    draws = np.random.default_rng(0).random((PERMUTATIONS, len(order)))
    drawn = means[draws.argsort(axis=1)[:, : len(new)]].sum(axis=1)
    seen = means[: len(new)].sum()
    return float((1 + np.count_nonzero(drawn >= seen - 1e-9)) / (1 + PERMUTATIONS))

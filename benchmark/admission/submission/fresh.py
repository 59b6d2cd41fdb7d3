"""Runs a submitted controller: on episodes of its bundle, and on seeds that nobody foresaw."""

import contextlib
import random
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from benchmark.admission.submission import code
from benchmark.admission.submission.checks import Bundle, Check, verdict
from benchmark.admission.submission.comparison import Comparison
from benchmark.admission.submission.manifest import Manifest
from benchmark.control import plugins
from benchmark.control import reference as naming
from benchmark.control.isolation.remote import Remote
from benchmark.control.training import FRESH_SEEDS
from benchmark.plumbing.errors import RightOfWayError
from benchmark.records.record import Record
from benchmark.study import rescoring
from benchmark.study.episode import Episode, run_episode, run_opened
from benchmark.study.episodes import build_ahead
from benchmark.study.pool import LocalPool


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
            return run_episode(mine)
        return run_opened(lambda: Remote(self.reference, mine.limits, self.path), mine)


def runner(folder: Path, manifest: Manifest, *, run_code: bool) -> Runner | str:
    """How to run a submitted controller; why not, in words, if that is impossible.

    An installed controller counts if its code is the submitted code.

    Args:
        folder: of the unpacked bundle.
        manifest: its manifest.
        run_code: whether code that the bundle brings may run.
    """
    reference = _reference(folder, manifest)
    name = naming.parse(manifest.name).name
    installed = None
    if name in plugins.discovered():  # never a file or module, which the manifest could choose
        with contextlib.suppress(RightOfWayError):
            installed = code.of(plugins.load_class(name))
    if installed is not None and installed.sha256 == manifest.code.sha256:
        return Runner(reference)
    here = "not installed" if installed is None else "installed with other code"
    if not manifest.code.included:
        return f"{manifest.code.source} is {here}, and the bundle brings no code"
    if not run_code:
        return (
            f"{manifest.code.source} is {here}; without --no-run-code what the bundle brings runs"
        )
    return Runner(reference, (str(folder / "code"), str(_installed(folder, manifest))))


def _reference(folder: Path, manifest: Manifest) -> str:
    """The controller's reference with files of the bundle in place of files elsewhere."""
    parts = naming.parse(manifest.name)
    options = parts.options()
    name = parts.placed(folder / "code").name
    options |= {key: str(folder / place) for key, place in manifest.options.items()}
    return f"{name}?{naming.query(options)}" if options else name


def _installed(folder: Path, manifest: Manifest) -> Path:
    """A folder that makes the bundle's code an installed distribution, for its entry point."""
    name, _, version = manifest.code.source.partition(" ")
    entry = manifest.name.partition("?")[0]
    here = folder / "installed"
    if ":" in entry:  # found by its file or module
        here.mkdir()
        return here
    info = here / f"{re.sub('[^A-Za-z0-9]+', '_', name)}-{version}.dist-info"
    info.mkdir(parents=True)
    head = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
    (info / "METADATA").write_text(head, encoding="utf-8")
    lines = f"[{plugins.GROUP}]\n{entry} = {manifest.code.place}\n"
    (info / "entry_points.txt").write_text(lines, encoding="utf-8")
    return here


def draws(count: int, bundle: Bundle, wanted: Sequence[int] = ()) -> list[list[int]]:
    """Two draws of seeds that nobody evaluates or validates on, anew each time.

    None that the controller says it was trained on are among them.

    Args:
        count: seeds of a draw.
        bundle: the submission.
        wanted: seeds that belong to the first draw.
    """
    places = {record.scenario for record in bundle.records}
    met = bundle.manifest.trained_on or ()
    free = [
        seed
        for seed in FRESH_SEEDS
        if seed not in wanted
        and not any(traffic.meets(name, seed) for traffic in met for name in places)
    ]
    first = list(dict.fromkeys(wanted))
    drawn = random.SystemRandom().sample(free, min(2 * count, len(free)))
    more = max(0, count - len(first))
    return [sorted(draw) for draw in ([*first, *drawn[:more]], drawn[more : more + count]) if draw]


def again(bundle: Bundle, how: Runner, workers: int) -> Check:
    """Run the first good episode of each cell under the controller itself."""
    firsts: dict[tuple[str, float | None], Record] = {}
    for record in sorted(bundle.good, key=lambda good: good.seed):
        firsts.setdefault((record.scenario, record.rate), record)
    episodes = [
        rescoring.LoggedEpisode.of(bundle.logs[record.episode]) for record in firsts.values()
    ]
    records = {
        (record.scenario, record.rate, record.seed): record
        for _, record in LocalPool(workers, work=how).run(episodes)
    }
    problems = []
    for original in firsts.values():
        made = records[original.scenario, original.rate, original.seed]
        names = {"controller": original.controller, "controller_from": original.controller_from}
        if differing := rescoring.differences(original, made.model_copy(update=names)):
            where = naming.place(original.scenario, original.rate, original.seed)
            problems.append(f"{where}: {made.reason or differing[0]}")
    whose = "of the bundle" if how.path else "as installed here"
    words = f"its code {whose} makes the same records in {len(firsts)} episodes"
    return verdict("controller", problems, words)


def fresh(bundle: Bundle, how: Runner, drawn: Sequence[Sequence[int]], workers: int) -> Check:
    """Run the controller on other seeds, and see whether it does worse there.

    Args:
        bundle: the submission.
        how: to run its controller.
        drawn: seeds, draw by draw. A draw may happen to be of heavy seeds, so the controller is
            objected to only if each speaks against it; the next is run only where the one before
            does.
        workers: processes.
    """
    comparisons: list[Comparison] = []
    for seeds in drawn:
        comparisons.append(Comparison(bundle.records, _made(bundle, how, seeds, workers)))
        if not comparisons[-1].speaks_against:
            break
    words, last = ", and on ".join(comparison.words for comparison in comparisons), comparisons[-1]
    if last.speaks_against:
        return verdict("fresh seeds", [f"does worse on {words}: fitted to its own?"], "")
    if last.bad or not last.can_tell:
        few = "" if last.can_tell else "; too few seeds to tell"
        return Check("fresh seeds", "noted", words + few)
    return verdict("fresh seeds", [], words)


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

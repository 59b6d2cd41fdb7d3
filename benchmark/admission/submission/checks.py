"""What can be said of a bundle without running an episode."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from benchmark.admission.submission import code, contents, names
from benchmark.admission.submission import manifest as manifests
from benchmark.admission.submission.manifest import Manifest
from benchmark.control import plugins
from benchmark.control import reference as naming
from benchmark.control.training import Training
from benchmark.plumbing import confined
from benchmark.plumbing.errors import RightOfWayError
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.scenario import catalogue
from benchmark.study import action_log, rescoring
from benchmark.study.action_log import ActionLog

LAST_SEED = 1000  # of evaluation
OWN = "rightofway"  # whose controllers every installation has

Logs = Mapping[tuple[str, str, str, float | None, int], ActionLog]
"""Action logs by episode."""

Verdict = Literal["ok", "noted", "failed", "not checked"]


@dataclass(frozen=True)
class Check:
    """One line of a verification."""

    name: str
    verdict: Verdict
    words: str


@dataclass(frozen=True)
class Bundle:
    """An unpacked bundle that hangs together."""

    folder: Path
    manifest: Manifest
    records: Sequence[Record]
    logs: Logs

    @property
    def good(self) -> list[Record]:
        """The records of episodes that ended well."""
        return [record for record in self.records if record.status == "ok"]


def verdict(name: str, problems: Sequence[str], fine: str) -> Check:
    """A check that fails if there are problems; the first three of them are named."""
    if not problems:
        return Check(name, "ok", fine)
    more = f"; and {len(problems) - 3} more" if len(problems) > 3 else ""
    return Check(name, "failed", "; ".join(problems[:3]) + more)


def files(folder: Path, members: Sequence[str], manifest: Manifest) -> Check:
    """Whether exactly the files that the manifest names are there, as they were hashed."""
    held = set(members) - {manifests.NAME}
    problems = [f"{name} is missing" for name in sorted(manifest.files.keys() - held)]
    problems += [f"{name} is not in the manifest" for name in sorted(held - manifest.files.keys())]
    problems += [
        f"{name} was changed"
        for name in sorted(held & manifest.files.keys())
        if manifests.sha256(folder / name) != manifest.files[name]
    ]
    if manifest.code.included:
        brought = code.in_folder(folder / "code", manifest.code.place)
        if not brought.files:
            problems.append("code/ is empty and the manifest says that it is included")
        elif brought.sha256 != manifest.code.sha256:
            problems.append("code/ is not the code whose hash the manifest names")
    problems += [
        f"option {key}: {value} is no file of the bundle; give a file that `submit` can bundle"
        for key, value in naming.parse(manifest.name).options().items()
        if key not in manifest.options and confined.may_lead_out(value)
    ]
    problems += [
        f"option {key}: {place} is missing"
        for key, place in sorted(manifest.options.items())
        if place not in held
    ]
    return verdict("files", problems, f"{len(held)} files have the hashes of the manifest")


def name_problems(controller: str, source: str, scenarios: Iterable[str] = ()) -> Iterator[str]:
    """What is wrong with the names that a board would show.

    Args:
        controller: its name, with options.
        source: the distribution that it is from.
        scenarios: their names.
    """
    shipped = [
        name
        for name, entry in plugins.discovered().items()
        if entry.dist and entry.dist.name == OWN
    ]
    if problem := names.controller_problem(controller, source, shipped):
        yield problem
    yield from names.scenario_problems(scenarios, catalogue.shipped_scenarios())


def weights(folder: Path, members: Sequence[str], manifest: Manifest) -> Check:
    """Whether nothing in the bundle runs when it is loaded, and weights are declared."""
    problems = [
        f"{name} {why}"
        for name in members
        if (why := contents.place_problem(name) or contents.content_problem(folder / name))
    ]
    brought = [name for name in members if contents.is_weights(name)]
    if brought and manifest.trained_on is None:
        problems.append(
            f"{brought[0]}: weights, and no word of what they were trained on; set trained_on, "
            "which is () for what nobody trained"
        )
    fine = f"{len(brought)} files of weights, none of which can run code"
    return verdict("weights", problems, fine)


def opened(folder: Path, manifest: Manifest) -> tuple[Check, Bundle | None]:
    """Read records and action logs and hold them against each other and the manifest."""
    try:
        records = Store(folder).read()
        paths = sorted((folder / "actions").glob("*.parquet"))
        logs = {log.record.episode: log for log in map(action_log.read_log, paths)}
        for log in logs.values():
            rescoring.check_scenario(log)
    except RightOfWayError as error:
        words = str(error).replace(f"{folder}/", "")
        return Check("records", "failed", words), None
    source = manifest.code.source.partition(" ")[0]
    problems = [
        *name_problems(manifest.name, source, (record.scenario for record in records)),
    ]
    problems += [*_foreign(records, manifest), *_grid(records), *_unlogged(records, logs)]
    if len(paths) > len(logs) or logs.keys() - {record.episode for record in records}:
        problems.append("there are action logs of episodes without a record, or two of one")
    good = sum(record.status == "ok" for record in records)
    if not good:
        problems.append("no episode ended well")
    if problems:
        return verdict("records", problems, ""), None
    others = len(records) - good
    words = f"{good} episodes with their action logs"
    if own := sorted(
        {record.scenario for record in records if not rescoring.is_shipped(record.scenario)}
    ):
        words += f", on scenarios of its own ({', '.join(own)})"
    if others:
        bad = next(record for record in records if record.status != "ok")
        words += f"; {others} did not end well, such as seed {bad.seed} of {bad.scenario}"
        words += f" ({bad.status}: {bad.reason})"
    check = Check("records", "noted" if others else "ok", words)
    return check, Bundle(folder, manifest, records, logs)


def _foreign(records: Sequence[Record], manifest: Manifest) -> Iterator[str]:
    for record in records:
        where = naming.place(record.scenario, record.rate, record.seed)
        if record.controller != manifest.name:
            yield f'{where}: of "{record.controller}", the manifest names "{manifest.name}"'
        if record.versions != manifest.versions:
            yield f"{where}: made with other versions than the manifest names"
        if record.status == "ok" and (record.weights_hash, record.trained_on) != (
            manifest.weights_hash,
            manifest.trained_on,
        ):
            yield f"{where}: other weights or training traffic than the manifest declares"


def _grid(records: Sequence[Record]) -> Iterator[str]:
    """Seeds that were picked, or cells that were left out, would make any figure good."""
    cells: dict[tuple[str, float | None], list[int]] = {}
    for record in records:
        cells.setdefault((record.scenario, record.rate), []).append(record.seed)
    longest = max(map(len, cells.values()))
    for (scenario, rate), seeds in cells.items():
        if sorted(seeds) != list(range(1, longest + 1)):
            yield f"{naming.place(scenario, rate)}: expected the seeds 1 to {longest}, each once"
    if longest > LAST_SEED:
        yield f"seeds over {LAST_SEED} are not for evaluation"


def _unlogged(records: Sequence[Record], logs: Logs) -> Iterator[str]:
    for record in records:
        if record.status == "ok":
            log = logs.get(record.episode)
            where = naming.place(record.scenario, record.rate, record.seed)
            if log is None:
                yield f"{where}: has no action log"
            elif log.record != record:
                yield f"{where}: its action log holds another record"


def training(bundle: Bundle) -> Check:
    """What the weights were trained on, and whether these episodes are among it."""
    declared = bundle.manifest.trained_on
    if declared is None:
        if bundle.manifest.weights_hash is not None:
            return Check("training", "failed", "weights, and no word of what they were trained on")
        return Check("training", "ok", "no weights, and nothing declared")
    own = {record.scenario for record in bundle.records}
    if problems := [*training_problems(declared, own)]:
        return verdict("training", problems, "")
    words = "; ".join(
        f"{', '.join(traffic.scenarios)} seeds {traffic.first} to {traffic.last}"
        for traffic in declared
    )
    if unseen := sorted(
        {name for traffic in declared for name in traffic.scenarios if _file(name)}
    ):
        words += f"; {', '.join(unseen)}: files that nobody here has seen"
    met = {
        record.seed
        for record in bundle.records
        if any(traffic.meets(record.scenario, record.seed) for traffic in declared)
    }
    if met:
        words += f"; among them are {len(met)} seeds of this evaluation: the row will be flagged"
    return Check("training", "noted" if met or unseen else "ok", words or "on no traffic")


def training_problems(declared: Sequence[Training], own: Collection[str] = ()) -> Iterator[str]:
    """What is wrong with a declaration: seeds kept for verifiers, and scenarios that are none.

    Args:
        declared: what a controller says that it was trained on.
        own: scenarios besides the shipped ones.
    """
    known = {
        part for name in (*catalogue.shipped_scenarios(), *own) for part in (name, *name.split("/"))
    }
    for traffic in declared:
        if problem := traffic.problem:
            yield f"trained_on: {problem}"
        for name in traffic.scenarios:
            if not (_file(name) or (name.rpartition("@")[0] or name) in known):
                yield (
                    f'trained_on: unknown scenario "{name}"; expected a shipped one, a folder of '
                    "them, or a file as in my-crossing.toml"
                )


def _file(name: str) -> bool:
    return (name.rpartition("@")[0] or name).endswith(".toml")

"""What can be said of a bundle without running an episode."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from benchmark.admission.submission import code, contents, manifest
from benchmark.admission.submission.manifest import Manifest
from benchmark.control import reference
from benchmark.plumbing.errors import RightOfWayError
from benchmark.records.record import Record
from benchmark.records.store import Store
from benchmark.study import action_log, rescoring
from benchmark.study.action_log import ActionLog

LAST_SEED = 1000  # of evaluation

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
        return [one for one in self.records if one.status == "ok"]


def verdict(name: str, problems: Sequence[str], fine: str) -> Check:
    """A check that fails if there are problems; the first three of them are named."""
    if not problems:
        return Check(name, "ok", fine)
    more = f"; and {len(problems) - 3} more" if len(problems) > 3 else ""
    return Check(name, "failed", "; ".join(problems[:3]) + more)


def files(folder: Path, names: Sequence[str], said: Manifest) -> Check:
    """Whether exactly the files that the manifest names are there, as they were hashed."""
    held = set(names) - {manifest.NAME}
    problems = [f"{name} is missing" for name in sorted(said.files.keys() - held)]
    problems += [f"{name} is not in the manifest" for name in sorted(held - said.files.keys())]
    problems += [
        f"{name} was changed"
        for name in sorted(held & said.files.keys())
        if manifest.sha256(folder / name) != said.files[name]
    ]
    if said.code.included:
        brought = code.in_folder(folder / "code", said.code.place)
        if not brought.files:
            problems.append("code/ is empty and the manifest says that it is included")
        elif brought.sha256 != said.code.sha256:
            problems.append("code/ is not the code whose hash the manifest names")
    problems += [
        f"option {key}: {place} is missing"
        for key, place in sorted(said.options.items())
        if place not in held
    ]
    return verdict("files", problems, f"{len(held)} files have the hashes of the manifest")


def weights(folder: Path, names: Sequence[str]) -> Check:
    """Whether nothing in the bundle runs when it is loaded."""
    problems = [
        f"{name} {why}"
        for name in names
        if (why := contents.place_problem(name) or contents.content_problem(folder / name))
    ]
    count = sum(map(contents.is_weights, names))
    return verdict("weights", problems, f"{count} files of weights, none of which can run code")


def opened(folder: Path, said: Manifest) -> tuple[Check, Bundle | None]:
    """Read records and action logs and hold them against each other and the manifest."""
    try:
        records = Store(folder).read()
        paths = sorted((folder / "actions").glob("*.parquet"))
        logs = {log.record.episode: log for log in map(action_log.read, paths)}
        for log in logs.values():
            rescoring.check_scenario(log)
    except RightOfWayError as error:
        words = str(error).replace(f"{folder}/", "")
        return Check("records", "failed", words), None
    problems = [*_foreign(records, said), *_grid(records), *_unlogged(records, logs)]
    if len(paths) > len(logs) or logs.keys() - {one.episode for one in records}:
        problems.append("there are action logs of episodes without a record, or two of one")
    good = sum(one.status == "ok" for one in records)
    if not good:
        problems.append("no episode ended well")
    if problems:
        return verdict("records", problems, ""), None
    others = len(records) - good
    words = f"{good} episodes with their action logs"
    if own := sorted({one.scenario for one in records if not rescoring.is_shipped(one.scenario)}):
        words += f", on scenarios of its own ({', '.join(own)})"
    if others:
        bad = next(one for one in records if one.status != "ok")
        words += f"; {others} did not end well, such as seed {bad.seed} of {bad.scenario}"
        words += f" ({bad.status}: {bad.reason})"
    check = Check("records", "noted" if others else "ok", words)
    return check, Bundle(folder, said, records, logs)


def _foreign(records: Sequence[Record], said: Manifest) -> Iterator[str]:
    for one in records:
        where = reference.place(one.scenario, one.rate, one.seed)
        if one.controller != said.name:
            yield f'{where}: of "{one.controller}", the manifest names "{said.name}"'
        if one.versions != said.versions:
            yield f"{where}: made with other versions than the manifest names"
        if one.status == "ok" and (one.weights_hash, one.trained_on) != (
            said.weights_hash,
            said.trained_on,
        ):
            yield f"{where}: other weights or training traffic than the manifest declares"


def _grid(records: Sequence[Record]) -> Iterator[str]:
    """Seeds that were picked, or cells that were left out, would make any figure good."""
    cells: dict[tuple[str, float | None], list[int]] = {}
    for one in records:
        cells.setdefault((one.scenario, one.rate), []).append(one.seed)
    longest = max(map(len, cells.values()))
    for (scenario, rate), seeds in cells.items():
        if sorted(seeds) != list(range(1, longest + 1)):
            yield f"{reference.place(scenario, rate)}: expected the seeds 1 to {longest}, each once"
    if longest > LAST_SEED:
        yield f"seeds over {LAST_SEED} are not for evaluation"


def _unlogged(records: Sequence[Record], logs: Logs) -> Iterator[str]:
    for one in records:
        if one.status == "ok":
            log = logs.get(one.episode)
            where = reference.place(one.scenario, one.rate, one.seed)
            if log is None:
                yield f"{where}: has no action log"
            elif log.record != one:
                yield f"{where}: its action log holds another record"


def training(bundle: Bundle) -> Check:
    """What the weights were trained on, and whether these episodes are among it."""
    declared = bundle.manifest.trained_on
    if declared is None:
        if bundle.manifest.weights_hash is not None:
            return Check("training", "failed", "weights, and no word of what they were trained on")
        return Check("training", "ok", "no weights, and nothing declared")
    words = "; ".join(
        f"{', '.join(one.scenarios)} seeds {one.first} to {one.last}" for one in declared
    )
    met = {
        record.seed
        for record in bundle.records
        if any(one.meets(record.scenario, record.seed) for one in declared)
    }
    if met:
        words += f"; among them are {len(met)} seeds of this evaluation: the row will be flagged"
    return Check("training", "noted" if met else "ok", words or "on no traffic")

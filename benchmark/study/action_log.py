"""Action logs: one file per episode holds its commands and all that is needed to score them again.

A log is a Parquet file (zstd), a row per command; its metadata holds the record, the scenario, the
signal program that ran, and a SHA-256 over everything. polars writes it: it imports in a tenth of a
second and, unlike pyarrow, brings no second copy of the libarrow that libsumo is linked to.
"""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from benchmark.control.guard import PROGRAMS
from benchmark.plumbing import files, parquet
from benchmark.plumbing.depth import check_depth
from benchmark.plumbing.errors import ActionLogError, ScenarioError, StoreError
from benchmark.records.record import Record
from benchmark.scenario import scenario as scenarios
from benchmark.scenario.scenario import Scenario
from benchmark.scenario.signal import Signal
from benchmark.study.actions import Action, Recording

if TYPE_CHECKING:
    import polars

KEY = "rightofway"  # of the file's metadata
FORMAT = 2
LARGEST = 64 * 2**20  # bytes of a file; an episode of 1000 s takes some ten thousand
MOST_ACTIONS = 2_000_000
LARGEST_HEAD = 8 * 2**20  # characters of the metadata; an episode's record and scenario have 50 000
LARGEST_UNPACKED = 256 * 2**20  # bytes of columns, and of texts once each row has its own
LONGEST_TEXT = 1000  # bytes of a vehicle's or junction's id
Key = tuple[str, str, str, float | None, int]  # ``Record.episode``


@dataclass(frozen=True)
class ActionLog:
    """The commands of one episode."""

    path: Path
    record: Record  # what the episode left behind
    scenario: Scenario
    programs: Mapping[str, Signal]  # that ran, by junction, where signals ruled
    actions: Sequence[Action]


def log_folder(results: Path) -> Path:
    """Where a results folder keeps its logs."""
    return results / "actions"


def log_name(episode: Key) -> str:
    """The file's name: for people to find it, and a hash that tells every two episodes apart."""
    scenario, _, *others = episode
    words = [scenario, *map(str, others)]
    plain = [re.sub(r"[^A-Za-z0-9.]+", "-", word)[:40].strip("-.") for word in words]
    code = hashlib.sha256(json.dumps(episode).encode()).hexdigest()[:12]
    return f"{'_'.join([*plain, code])}.parquet"


def write_log(folder: Path, recording: Recording, record: Record, scenario: Scenario) -> Path:
    """Write a log, whole or not at all.

    Raises:
        StoreError: the disk refuses.
    """
    rows = frame(recording.actions)
    head: dict[str, Any] = {
        "format": FORMAT,
        "record": record.model_dump(mode="json", by_alias=True),
        "scenario": scenario.model_dump(mode="json", by_alias=True, exclude_defaults=True),
        "programs": PROGRAMS.dump_python(dict(recording.programs), mode="json"),
    }
    head["sha256"] = _digest(head, rows)
    path = folder / log_name(record.episode)
    with files.writing(path, "the action log", StoreError, ""), files.replaced(path) as draft:
        rows.write_parquet(
            draft,
            compression="zstd",
            compression_level=9,
            statistics=False,
            metadata={KEY: json.dumps(head, separators=(",", ":"))},
        )
    return path


def has_log(folder: Path, episode: Key, identity: str) -> bool:
    """Whether a folder has the log of just this episode; its commands are not looked at."""
    import polars
    from polars.exceptions import PolarsError

    try:
        head = json.loads(polars.read_parquet_metadata(folder / log_name(episode)).get(KEY, ""))
        return bool(head["record"]["identity"] == identity)
    except (OSError, ValueError, KeyError, TypeError, PolarsError):
        return False


def read_log(path: Path) -> ActionLog:
    """Read a log and check that it is whole.

    Raises:
        ActionLogError: it is missing, no action log, changed since it was written, or written by a
            version that logs otherwise.
    """
    head, rows = _contents(path)
    if head.get("format") != FORMAT:
        raise ActionLogError(
            f"{path}: an action log of format {head.get('format')}, expected {FORMAT}; "
            "replay it with the Right of Way that wrote it"
        )
    noted = head.pop("sha256", None)
    if noted != _digest(head, rows):
        raise ActionLogError(
            f"{path}: does not match the SHA-256 noted in it: it was changed after it was written"
        )
    try:
        record = Record.model_validate_json(json.dumps(head["record"]))
        programs = PROGRAMS.validate_json(json.dumps(head["programs"]))
        scenario = scenarios.parse_scenario(head["scenario"], str(path), record.scenario)
    except (KeyError, TypeError, ScenarioError, ValidationError) as error:
        raise ActionLogError(
            f"{path}: its record, scenario or signal programs are none ({_line(error)}); was the "
            "log written by another version?"
        ) from error
    if scenario.hash != record.scenario_hash:
        raise ActionLogError(
            f"{path}: its scenario has the hash {scenario.hash[:12]}, its record names "
            f"{record.scenario_hash[:12]}; it was put together from two, or written by a Right of "
            f"Way ({record.versions.rightofway}) that hashes otherwise"
        )
    return ActionLog(path, record, scenario, programs, [Action(*row) for row in rows.iter_rows()])


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def _schema() -> Mapping[str, Any]:
    import polars

    kinds = {"step": polars.UInt32, "acceleration": polars.Float64, "lane_change": polars.Int8}
    return {name: kinds.get(name, polars.String) for name in Action._fields}


def frame(actions: Sequence[Action]) -> "polars.DataFrame":
    """Actions as the table that a log holds, a row each."""
    import polars

    return polars.DataFrame(actions, schema=dict(_schema()), orient="row")


def _contents(path: Path) -> tuple[dict[str, Any], "polars.DataFrame"]:
    """What the file holds; nothing of it is trusted yet."""
    import polars
    from polars.exceptions import PanicException, PolarsError

    refused = f"{path}: not an action log; expected a file that `run --log-actions` wrote"
    try:
        if path.stat().st_size > LARGEST:
            raise ActionLogError(f"{path}: larger than an action log can be ({LARGEST} bytes)")
        with path.open("rb") as file:
            if file.read(4) != b"PAR1":
                raise ActionLogError(refused)
        _check_sizes(path)
        text = polars.read_parquet_metadata(path).get(KEY, "")
        if len(text) > LARGEST_HEAD:
            raise ActionLogError(f"{path}: its metadata is longer than that of an action log")
        head = json.loads(text)
        check_depth(head)
        if dict(polars.read_parquet_schema(path)) != _schema() or not isinstance(head, dict):
            raise ActionLogError(refused)
        rows = polars.scan_parquet(path).head(MOST_ACTIONS + 1).collect()
    except OSError as error:
        raise ActionLogError(
            f"{path}: cannot read the action log: {error.strerror or error}"
        ) from error
    except (PanicException, PolarsError, ValueError, RecursionError) as error:
        raise ActionLogError(f"{refused}; the file may be cut off") from error
    _check_texts(path, rows)
    return head, rows


def _check_sizes(path: Path) -> None:
    """Refuse what would fill the memory before it is decoded."""
    sizes = parquet.sizes(path)
    if sizes.rows > MOST_ACTIONS or sizes.values > 2 * MOST_ACTIONS * len(_schema()):
        raise ActionLogError(f"{path}: more than {MOST_ACTIONS} commands; no episode has so many")
    if sizes.decompressed > LARGEST_UNPACKED:
        raise ActionLogError(f"{path}: unpacks to more than {LARGEST_UNPACKED} bytes")


def _check_texts(path: Path, rows: "polars.DataFrame") -> None:
    """Refuse texts that lie in the file once and would lie in memory once for every row."""
    import polars

    lengths = rows.select(polars.col(polars.String).str.len_bytes())
    longest = max(lengths.max().row(0), key=lambda length: length or 0) or 0
    total = sum(length or 0 for length in lengths.sum().row(0))
    if longest > LONGEST_TEXT or total > LARGEST_UNPACKED:
        raise ActionLogError(
            f"{path}: a text of {longest} bytes, {total} bytes in all; at most {LONGEST_TEXT} and "
            f"{LARGEST_UNPACKED}"
        )


def _digest(head: Mapping[str, Any], rows: "polars.DataFrame") -> str:
    """SHA-256 of all that a log says, however Parquet packs it."""
    total = hashlib.sha256(json.dumps(head, sort_keys=True).encode())
    for column in rows.iter_columns():
        total.update(f"\n{column.name} {json.dumps(column.to_list())}".encode())
    return total.hexdigest()

"""A reference: the records that a regression check holds new ones against, and their origin.

In its folder ``records/*.jsonl`` are as in any results folder, and ``reference.toml`` says what
made them. A results folder without one serves too; nothing then tells whether it is whole.
"""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmark.plumbing import files
from benchmark.plumbing.errors import StoreError, UsageError
from benchmark.records.provenance import Provenance, read_provenance
from benchmark.records.record import Record
from benchmark.records.store import Notice, Store

FILE = "reference.toml"
REMEDY = "restore it, or make it anew with `rightofway reference update`"


@dataclass(frozen=True)
class RegressionReference:
    """Records to be equalled."""

    records: list[Record]
    provenance: Provenance | None  # None for a plain results folder


def read_reference(folder: Path, notice: Notice) -> RegressionReference:
    """Read a reference, or a plain results folder as one.

    Args:
        folder: the folder, or its records folder.
        notice: told what the user should know.

    Raises:
        StoreError: there is none, it is not whole, or it is of a newer schema.
    """
    folder = files.results_folder(folder)
    records = Store(folder, notice=_refuse).read() if _has_records(folder) else []
    if not records:
        raise StoreError(
            f"{folder}: no reference here; "
            f"make one with `rightofway reference update --out {folder}`"
        )
    if not (folder / FILE).exists():
        notice(f"{folder}: no {FILE}, so nothing says what made these records")
        return RegressionReference(records, None)
    made = read_provenance(folder / FILE)
    if (made.episodes, made.records_hash) != (len(records), hash_of_lines(folder)):
        raise StoreError(
            f"{folder}: the records are not those that {FILE} tells of "
            f"({len(records)} instead of {made.episodes}, or changed); {REMEDY}"
        )
    return RegressionReference(records, made)


def _has_records(folder: Path) -> bool:
    return any((folder / "records").glob("*.jsonl"))


def _refuse(message: str) -> None:
    """A reference that is not whole would let regressions pass."""
    raise StoreError(f"{message}, but a reference must be whole; {REMEDY}")


def hash_of_lines(folder: Path) -> str:
    """SHA-256 of the lines of all records, sorted: the same for any ends of lines and files."""
    lines = (
        line
        for path in (folder / "records").glob("*.jsonl")
        for line in path.read_bytes().splitlines()
        if line
    )
    return hashlib.sha256(b"\n".join(sorted(lines))).hexdigest()


def check_target(folder: Path) -> None:
    """Make sure that a folder can become a reference, before any episode is run.

    Raises:
        UsageError: it holds what is no part of a reference and would be lost.
        StoreError: it cannot be written beside.
    """
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: is a file; choose another folder with --out")
    names = {path.name for path in folder.iterdir()} if folder.exists() else set()
    if names and FILE not in names:
        raise UsageError(
            f"{folder}: holds {min(names)} but no {FILE}, so it is no reference that could be "
            "replaced; choose another folder with --out"
        )
    if foreign := names - {FILE, "records"}:
        raise UsageError(
            f"{folder}: {min(foreign)} is no part of a reference and would be lost; move it away"
        )
    with files.writing(folder, "beside it", StoreError, "choose another folder with --out"):
        folder.parent.mkdir(parents=True, exist_ok=True)
        files.probe(folder.parent)


def write_reference(folder: Path, records: Sequence[Record], made: Provenance) -> None:
    """Replace a reference by a new one; the old one stays whole until the new one is.

    Args:
        folder: where, as ``check_target`` accepts it.
        records: what it is to hold; their wall times, which differ by machine, are left out.
        made: its provenance; number and hash of records are filled in here.

    Raises:
        StoreError: the disk refuses; the old reference stays.
    """
    with files.writing(folder, "the reference", StoreError, ""):
        folder.parent.mkdir(parents=True, exist_ok=True)
        with files.replaced(folder) as draft:
            _fill(draft, records, made)


def _fill(folder: Path, records: Iterable[Record], made: Provenance) -> None:
    store = Store(folder)
    store.prepare()
    ordered = sorted(
        records, key=lambda record: (*record.episode[:3], record.rate or 0.0, record.seed)
    )
    for record in ordered:
        store.append(record.model_copy(update={"wall_time": 0.0}))
    facts = {"episodes": len(ordered), "records_hash": hash_of_lines(folder)}
    (folder / FILE).write_text(made.model_copy(update=facts).as_toml(), encoding="utf-8")

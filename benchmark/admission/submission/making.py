"""Makes a bundle: what a controller, its package and the command line say, and what was run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from email.utils import getaddresses
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

from benchmark.admission.submission import archive, contents, manifest
from benchmark.admission.submission import code as codes
from benchmark.admission.submission.code import Code
from benchmark.admission.submission.manifest import Manifest
from benchmark.control import plugins
from benchmark.control.plugins import Plugin
from benchmark.control.training import Training
from benchmark.plumbing import files
from benchmark.plumbing.errors import BundleError
from benchmark.records.record import Record, Versions

OWN = "rightofway"  # whose controllers every installation has


@dataclass(frozen=True)
class Words:
    """What the command line says of a submission; None takes the package's metadata."""

    authors: Sequence[str] = ()
    description: str | None = None
    paper: str | None = None
    licence: str | None = None


@dataclass(frozen=True)
class Subject:
    """A controller that is to be submitted, with all that has to be known before it runs."""

    plugin: Plugin
    source: str
    code: Code
    includes_code: bool
    words: Words

    @property
    def option_files(self) -> dict[str, Path]:
        """Options whose values are files."""
        return {key: one for key, one in self.plugin.options.items() if isinstance(one, Path)}


def subject(reference: str, words: Words, *, with_code: bool) -> Subject:
    """Gather what is to be said of a controller.

    Raises:
        ControllerError: there is no such controller.
        BundleError: neither package nor command line say who made it and under which licence, it
            does not declare what its weights were trained on, or it holds weights that can run
            code when they are loaded.
    """
    plugin = plugins.find(reference)
    source = plugins.provenance(reference)
    found = Subject(
        plugin,
        source,
        codes.of(plugin.kind),
        with_code and source.partition(" ")[0] != OWN,
        _completed(plugin, source, words),
    )
    one = plugin.new()
    if one.weights_hash and one.trained_on is None:
        raise BundleError(
            f"{reference}: has weights and does not declare what they were trained on; set "
            "trained_on, as in trained_on = (Training(scenarios=..., first=..., last=...),)"
        )
    for key, path in found.option_files.items():
        if why := contents.place_problem(f"weights/{path.name}") or contents.content_problem(path):
            raise BundleError(f"{reference}: {key}: {path} {why}")
    return found


def _completed(plugin: Plugin, source: str, words: Words) -> Words:
    facts = _package(source.partition(" ")[0])
    found = Words(
        words.authors or facts.get("authors", ()),
        words.description or plugins.description(plugin.kind),
        words.paper or facts.get("paper", ""),
        words.licence or facts.get("licence"),
    )
    needed = {"author": found.authors, "licence": found.licence}
    if lacking := [name for name, value in needed.items() if not value]:
        raise BundleError(
            f"{plugin.reference}: its package does not name its {' and '.join(lacking)}; "
            f"give {' and '.join(f'--{name}' for name in lacking)}"
        )
    if not found.description:
        raise BundleError(f"{plugin.reference}: has no docstring; give --description")
    return found


def _package(distribution: str) -> dict[str, Any]:
    """What a distribution says of itself."""
    try:
        facts = metadata(distribution)
    except PackageNotFoundError:
        return {}
    people = getaddresses(facts.get_all("Author-email", []))
    authors = [name or address for name, address in people if name or address]
    licences = facts.get_all("License-Expression", []) or facts.get_all("License", [])
    links = [line.partition(",") for line in facts.get_all("Project-URL", [])]
    papers = [url.strip() for label, _, url in links if label.strip().lower() in ("paper", "doi")]
    return {
        "authors": tuple(authors or facts.get_all("Author", [])),
        "licence": next((one for one in licences if "\n" not in one), None),  # not a whole text
        "paper": papers[0] if papers else "",
    }


def write(target: Path, subject: Subject, results: Path, records: Sequence[Record]) -> None:
    """Write a bundle, whole or not at all.

    Args:
        target: the file.
        subject: whose bundle it is.
        results: the folder with its records and action logs.
        records: the same records.

    Raises:
        BundleError: no episode ended well, or the disk refuses.
    """
    good = [one for one in records if one.status == "ok"]
    if not good:
        raise BundleError(
            f"{subject.plugin.reference}: none of {len(records)} episodes ended well "
            f"({records[0].status}: {records[0].reason}); there is nothing to submit"
        )
    members = dict(_members(subject, results))
    said = _manifest(subject, good[0], members)
    with files.writing(target, "the bundle", BundleError, ""), files.replaced(target) as draft:
        archive.write(draft, {manifest.NAME: said.text().encode(), **members})


def _members(subject: Subject, results: Path) -> Sequence[tuple[str, Path]]:
    kept = [
        (f"{folder}/{path.name}", path)
        for folder, kind in (("records", "*.jsonl"), ("actions", "*.parquet"))
        for path in sorted((results / folder).glob(kind))
    ]
    if subject.includes_code:
        kept += [(f"code/{name}", path) for name, path in sorted(subject.code.files.items())]
    return [*kept, *((f"weights/{one.name}", one) for one in subject.option_files.values())]


def _manifest(subject: Subject, record: Record, members: Mapping[str, Path]) -> Manifest:
    words = subject.words
    trained_on: tuple[Training, ...] | None = record.trained_on
    versions: Versions = record.versions
    assert words.description is not None
    assert words.licence is not None
    return Manifest(
        format=manifest.FORMAT,
        name=record.controller,
        authors=tuple(words.authors),
        description=words.description,
        paper=words.paper or "",
        licence=words.licence,
        code=manifest.Code(
            source=subject.source if " " in subject.source else f"{subject.source} unversioned",
            place=subject.code.place,
            sha256=subject.code.sha256,
            included=subject.includes_code,
        ),
        weights_hash=record.weights_hash,
        trained_on=trained_on,
        options={key: f"weights/{one.name}" for key, one in subject.option_files.items()},
        versions=versions,
        files={name: manifest.sha256(path) for name, path in members.items()},
    )

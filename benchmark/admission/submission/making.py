"""Makes a bundle: what a controller, its package and the command line say, and what was run."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from email.utils import getaddresses
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

from benchmark.admission.submission import archive, checks, contents, fresh
from benchmark.admission.submission import code as codes
from benchmark.admission.submission import manifest as manifests
from benchmark.admission.submission.checks import OWN
from benchmark.admission.submission.code import CodeFiles
from benchmark.admission.submission.manifest import Manifest
from benchmark.control import plugins
from benchmark.control.plugins import Plugin
from benchmark.control.training import Training
from benchmark.plumbing import files
from benchmark.plumbing.errors import BundleError
from benchmark.records.record import Record, Versions


@dataclass(frozen=True)
class Attribution:
    """What the command line says of a submission; None takes the package's metadata."""

    authors: Sequence[str] = ()
    description: str | None = None
    paper: str | None = None
    licence: str | None = None


@dataclass(frozen=True)
class Submission:
    """A controller that is to be submitted, with all that has to be known before it runs."""

    plugin: Plugin
    source: str
    code: CodeFiles
    includes_code: bool
    attribution: Attribution

    @property
    def option_files(self) -> dict[str, Path]:
        """Options whose values are files."""
        return {key: path for key, path in self.plugin.options.items() if isinstance(path, Path)}


def gather(reference: str, attribution: Attribution, *, with_code: bool) -> Submission:
    """Gather all that is to be said of a controller.

    Raises:
        ControllerError: there is no such controller.
        BundleError: neither package nor command line say who made it and under which licence, it
            does not declare what its weights were trained on, or it holds weights that can run
            code when they are loaded.
    """
    plugin = plugins.find_controller(reference)
    source = plugins.provenance(reference)
    submission = Submission(
        plugin,
        source,
        codes.of(plugin.kind),
        with_code and source.partition(" ")[0] != OWN,
        _completed(plugin, source, attribution),
    )
    controller = plugin.new()
    weights = [name for name in submission.code.files if contents.is_weights(name)]
    has_weights = controller.weights_hash or (weights and submission.includes_code)
    if (has_weights or submission.option_files) and controller.trained_on is None:
        raise BundleError(
            f"{reference}: has weights and does not declare what they were trained on; set "
            "trained_on, as in trained_on = (Training(scenarios=..., first=..., last=...),); "
            "() stands for what nobody trained"
        )
    for key, path in submission.option_files.items():
        if why := contents.place_problem(f"weights/{path.name}") or contents.content_problem(path):
            raise BundleError(f"{reference}: {key}: {path} {why}")
    return submission


def ships(submission: Submission) -> bool:
    """Whether a controller ships with this package, so that nobody needs its code."""
    return submission.source.partition(" ")[0] == OWN


def check(submission: Submission, scenarios: Collection[str]) -> None:
    """Make sure, before anything runs, that what a controller declares would be accepted.

    Args:
        submission: the controller.
        scenarios: the names of those that it will run on.

    Raises:
        BundleError: its name, a scenario's, or the traffic that it was trained on would not.
    """
    source = submission.source.partition(" ")[0]
    declared = submission.plugin.new().trained_on or ()
    problems = [
        *checks.name_problems(submission.plugin.label, source, scenarios),
        *checks.training_problems(declared, scenarios),
    ]
    if problems:
        raise BundleError(f"{submission.plugin.reference}: {problems[0]}")


def lay_out(submission: Submission, folder: Path) -> fresh.Runner | None:
    """Copy a submission's code, as the bundle will bring it, and say how it is run from there.

    Args:
        submission: the controller.
        folder: where its code and weights go.

    Returns:
        None for what ships with this package.
    """
    if ships(submission):
        return None
    origin = _origin(submission)
    place = fresh.laid_out(submission.code, folder)
    return fresh.brought(submission.plugin.reference, place, origin, submission.option_files)


def _completed(plugin: Plugin, source: str, attribution: Attribution) -> Attribution:
    facts = _package(source.partition(" ")[0])
    complete = Attribution(
        attribution.authors or facts.get("authors", ()),
        attribution.description or plugins.description(plugin.kind),
        attribution.paper or facts.get("paper", ""),
        attribution.licence or facts.get("licence"),
    )
    needed = {"author": complete.authors, "licence": complete.licence}
    if lacking := [name for name, value in needed.items() if not value]:
        raise BundleError(
            f"{plugin.reference}: its package does not name its {' and '.join(lacking)}; "
            f"give {' and '.join(f'--{name}' for name in lacking)}"
        )
    if not complete.description:
        raise BundleError(f"{plugin.reference}: has no docstring; give --description")
    return complete


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
        "licence": next((text for text in licences if "\n" not in text), None),  # not a whole text
        "paper": papers[0] if papers else "",
    }


def write(target: Path, submission: Submission, results: Path, records: Sequence[Record]) -> None:
    """Write a bundle, whole or not at all.

    Args:
        target: the file.
        submission: whose bundle it is.
        results: the folder with its records and action logs.
        records: the same records.

    Raises:
        BundleError: no episode ended well, or the disk refuses.
    """
    good = [record for record in records if record.status == "ok"]
    if not good:
        raise BundleError(
            f"{submission.plugin.reference}: none of {len(records)} episodes ended well "
            f"({records[0].status}: {records[0].reason}); there is nothing to submit"
        )
    members = dict(_members(submission, results))
    manifest = _manifest(submission, good[0], members)
    with files.writing(target, "the bundle", BundleError, ""), files.replaced(target) as draft:
        archive.write(draft, {manifests.NAME: manifest.text().encode(), **members})


def _members(submission: Submission, results: Path) -> Sequence[tuple[str, Path]]:
    kept = [
        (f"{folder}/{path.name}", path)
        for folder, kind in (("records", "*.jsonl"), ("actions", "*.parquet"))
        for path in sorted((results / folder).glob(kind))
    ]
    if submission.includes_code:
        kept += [(f"code/{name}", path) for name, path in sorted(submission.code.files.items())]
    return [*kept, *((f"weights/{path.name}", path) for path in submission.option_files.values())]


def _manifest(submission: Submission, record: Record, members: Mapping[str, Path]) -> Manifest:
    attribution = submission.attribution
    trained_on: tuple[Training, ...] | None = record.trained_on
    versions: Versions = record.versions
    assert attribution.description is not None
    assert attribution.licence is not None
    return Manifest(
        format=manifests.FORMAT,
        name=record.controller,
        authors=tuple(attribution.authors),
        description=attribution.description,
        paper=attribution.paper or "",
        licence=attribution.licence,
        code=_origin(submission),
        weights_hash=record.weights_hash,
        trained_on=trained_on,
        options={key: f"weights/{path.name}" for key, path in submission.option_files.items()},
        versions=versions,
        files={name: manifests.sha256(path) for name, path in members.items()},
    )


def _origin(submission: Submission) -> manifests.CodeOrigin:
    """Where a submission's code is from, for the manifest."""
    source = submission.source
    return manifests.CodeOrigin(
        source=source if " " in source else f"{source} unversioned",
        place=submission.code.place,
        sha256=submission.code.sha256,
        included=submission.includes_code,
    )

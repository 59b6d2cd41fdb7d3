"""A bundle's manifest: who submits what, made with which versions, and the hash of every file."""

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from benchmark.admission.submission import names
from benchmark.control.training import Training
from benchmark.plumbing import confined, toml_file
from benchmark.plumbing.errors import BundleError
from benchmark.plumbing.messages import explain
from benchmark.plumbing.models import Table
from benchmark.records.record import Versions

NAME = "manifest.toml"
FORMAT: Literal[1] = 1

Line = Annotated[str, Field(min_length=1, max_length=2000)]
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class CodeOrigin(Table):
    """Where a controller's code is from."""

    source: str = Field(pattern=r"^[\w.-]+ [\w.:+!-]+$", description="distribution and version")
    place: str = Field(pattern=r"^[\w.-]+:[\w.]+$", description="module and class")
    sha256: Sha256 = Field(description="over the files that belong to it, as ``code.digest`` does")
    included: bool = Field(description="whether they lie in code/")


class Manifest(Table):
    """What a bundle says of itself."""

    format: Literal[1]
    name: Line = Field(description="the controller, with its options, as in records")
    authors: tuple[Line, ...] = Field(min_length=1)
    description: Line
    paper: str = Field("", max_length=2000, description="its title, DOI or address")
    licence: Line = Field(description="an SPDX expression, such as Apache-2.0")
    code: CodeOrigin
    weights_hash: Sha256 | None = Field(None, description="as in records")
    trained_on: tuple[Training, ...] | None = Field(
        None, description="the traffic that weights or settings were fitted to"
    )
    options: dict[str, str] = Field({}, description="options that are files, and where they lie")
    versions: Versions
    files: dict[str, Sha256] = Field(description="SHA-256 of every other file in the bundle")

    def text(self) -> str:
        """The manifest as TOML."""
        import tomli_w

        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))


def read(folder: Path) -> Manifest:
    """The manifest of an unpacked bundle.

    Raises:
        BundleError: there is none, or it says something impossible.
    """
    path = folder / NAME
    if not path.is_file():
        raise BundleError(f"the bundle has no {NAME}; expected what `rightofway submit` wrote")
    document = toml_file.read(path, BundleError)
    return parse(document)


def parse(document: dict[str, Any]) -> Manifest:
    """Validate a manifest's tables.

    Raises:
        BundleError: as ``read``.
    """
    try:
        manifest = Manifest.model_validate_json(json.dumps(document, default=str))
    except ValidationError as error:
        raise BundleError(explain(error, Manifest, NAME)) from error
    for name in (*manifest.files, *manifest.options.values()):
        if why := confined.problem(name):
            raise BundleError(f"{NAME}: the path {name!r} {why}")
    if not names.CONTROLLER.fullmatch(manifest.name):
        raise BundleError(f'{NAME}: name: "{manifest.name}" is no reference to a controller')
    return manifest


def sha256(path: Path) -> str:
    """The SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

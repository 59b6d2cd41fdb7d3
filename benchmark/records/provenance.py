"""What made a reference: command, suite, commit, versions, platform, date."""

import hashlib
import json
import platform
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import tomli_w
from pydantic import BaseModel, Field, PositiveInt, ValidationError

from benchmark.plumbing import toml_file
from benchmark.plumbing.errors import StoreError
from benchmark.plumbing.messages import explain
from benchmark.plumbing.models import Table
from benchmark.records.record import Versions

SCHEMA = 1


class Git(Table):
    """The repository in which a reference was made."""

    commit: str | None = Field(None, description="None before the first one.")
    dirty: bool = Field(description="Whether something was not committed.")


class Provenance(Table):
    """Where a reference comes from; ``reference.toml`` beside its records."""

    schema_: Literal[1] = Field(1, alias="schema", description="Version of this format.")
    made: str = Field(description="Date and time, UTC.")
    command: str
    suite: str
    suite_hash: str = Field(description="SHA-256 of what the suite's file says.")
    episodes: PositiveInt = Field(description="How many records there are.")
    records_hash: str = Field(description="SHA-256 of their lines, sorted.")
    platform: str
    versions: dict[str, str]
    git: Git | None = Field(None, description="None outside of a repository.")

    def as_toml(self) -> str:
        """The text of the file."""
        document = self.model_dump(mode="json", by_alias=True, exclude_none=True)
        return (
            f"# Made by `rightofway reference update`; not to be edited.\n{tomli_w.dumps(document)}"
        )

    def words(self) -> str:
        """One line for people."""
        commit = "no commit"
        if self.git and self.git.commit:
            commit = f"commit {self.git.commit[:12]}{' with changes' if self.git.dirty else ''}"
        numbers = ", ".join(f"{name} {number}" for name, number in self.versions.items())
        return f"suite {self.suite}, {self.made}, {commit}; {numbers}; {self.platform}"


def read_provenance(path: Path) -> Provenance:
    """Read and validate a ``reference.toml``.

    Raises:
        StoreError: it cannot be read, is not valid, or is of a newer schema.
    """
    document = toml_file.read(path, StoreError)
    schema = document.get("schema")
    if isinstance(schema, int) and schema > SCHEMA:
        raise StoreError(
            f"{path}: written by a newer Right of Way (schema {schema}); upgrade to read it"
        )
    try:
        return Provenance.model_validate_json(json.dumps(document, default=str))
    except ValidationError as error:
        raise StoreError(explain(error, Provenance, str(path))) from error


def hash_of(model: BaseModel) -> str:
    """SHA-256 of what a model says, whatever the order of its keys."""
    canonical = json.dumps(model.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def utc_now() -> str:
    """Date and time, UTC, to the second."""
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S")


def this_platform() -> str:
    """What floats may depend on: system, processor, C library. No host's name."""
    parts = (f"{platform.system()} {platform.machine()}", " ".join(platform.libc_ver()).strip())
    return ", ".join(part for part in parts if part)


def versions_behind(of_records: Versions) -> dict[str, str]:
    """What computed the records."""
    return {**of_records.model_dump(), "numpy": version("numpy")}

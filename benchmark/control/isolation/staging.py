"""A folder with copies of an isolated controller's code and files, laid out alike for everybody.

Where a controller is run, and for whom, cannot be told from where its code lies: ``run``,
``submit`` and ``verify`` all import it from here.
"""

import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path

from benchmark.control import plugins
from benchmark.control import reference as naming
from benchmark.control.code import NEIGHBOURS
from benchmark.control.reference import Reference
from benchmark.plumbing.errors import ControllerError

LARGEST = 1024 * 2**20  # bytes of a controller's code and files
OWN = frozenset({"benchmark", "baselines"})  # packages that every installation has
BESIDE = (NEIGHBOURS - {".py"}) | {".zip", ".json", ".csv", ".txt", ".toml"}
"""Kinds of files that a controller may read where they lie beside its own."""


@dataclass(frozen=True)
class Brought:
    """A controller's code and files that lie in a folder, as in an unpacked bundle."""

    code: Path  # the folder that is on its path
    place: str  # module and class, as in an entry point
    source: str  # distribution and version
    options: Mapping[str, Path] = field(default_factory=dict)  # files, by option


class Stage:
    """A controller's own folder; ``close`` removes it.

    Args:
        reference: the controller, with options; a file's path is absolute.
        brought: its code and files; None: as they are found here.

    Raises:
        ControllerError: they are missing, or too large.
    """

    def __init__(self, reference: str, brought: Brought | None = None) -> None:
        self._given = naming.parse(reference)
        self._folder = tempfile.TemporaryDirectory(
            prefix="rightofway-controller-", ignore_cleanup_errors=True
        )
        self.root = Path(self._folder.name).resolve()
        self._room = LARGEST
        self._renamed: dict[str, str] = {}
        try:
            code, place, source = _code_of(self._given) if brought is None else _in(brought)
            for name, path in code:
                self._copy(path, self.root / "code" / name)
            has_code = (self.root / "code").is_dir()
            self.path = self._importable(place, source) if has_code else ()
            options = _options_here(self._given) if brought is None else brought.options
            self.reference = str(self._placed(options))
        except OSError as error:
            self.close()
            where = f"{error.filename}: " if error.filename else ""
            raise ControllerError(f"{where}cannot be copied: {error.strerror}") from error
        except BaseException:
            self.close()
            raise

    @property
    def files(self) -> str:
        """The reference with those options alone that name files or folders."""
        parts = naming.parse(self.reference)
        named = {key: value for key, value in parts.options().items() if value in self._renamed}
        return str(replace(parts, query=naming.query(named)))

    def told(self, words: str) -> str:
        """Words of the controller's process, with paths as they were given."""
        for copy, path in self._renamed.items():
            words = words.replace(copy, path)
        return words.replace(f"{self.root}/", "")

    def given(self, reference: str) -> str:
        """A reference with paths as they were given, which the controller's process answered."""
        parts = naming.parse(reference)
        options = {key: self._renamed.get(value, value) for key, value in parts.options().items()}
        place = self._renamed.get(parts.place, parts.place)
        return str(replace(parts, place=place, query=naming.query(options)))

    def close(self) -> None:
        """Remove the folder."""
        self._folder.cleanup()

    def _copy(self, path: Path, target: Path) -> None:
        self._room -= path.stat().st_size
        if self._room < 0:
            raise ControllerError(
                f"{path}: an isolated controller's code and files may have {LARGEST} bytes; "
                "run what you trust with --no-isolate"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, target)

    def _importable(self, place: str, source: str) -> tuple[str, ...]:
        """The folders to import from, where an installed controller has its entry point."""
        if self._given.is_file:
            return ()
        if self._given.attribute:
            return (str(self.root / "code"),)
        name, _, version = source.partition(" ")
        stem = re.sub("[^A-Za-z0-9]+", "_", name)
        info = self.root / "installed" / f"{stem}-{version or 0}.dist-info"
        info.mkdir(parents=True)
        head = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version or 0}\n"
        (info / "METADATA").write_text(head, encoding="utf-8")
        lines = f"[{plugins.GROUP}]\n{self._given.place} = {place}\n"
        (info / "entry_points.txt").write_text(lines, encoding="utf-8")
        return str(self.root / "code"), str(info.parent)

    def _placed(self, files: Mapping[str, Path]) -> Reference:
        """The reference, with copies in place of files."""
        options = self._given.options()
        for key, path in files.items():
            target = path.resolve()
            if path.is_file():
                target = self.root / "files" / key / path.name
                self._copy(path, target)
            self._renamed[str(target)] = options.get(key, str(path))
            options[key] = str(target)
        place = self._given.place
        if self._given.is_file and (copy := self.root / "code" / Path(place).name).is_file():
            self._renamed[str(copy)] = place
            place = str(copy)
        return replace(self._given, place=place, query=naming.query(options))


Code = tuple[list[tuple[str, Path]], str, str]
"""Files by name, the entry point's value, and distribution and version."""


def _in(brought: Brought) -> Code:
    paths = sorted(path for path in brought.code.rglob("*") if path.is_file())
    named = [(path.relative_to(brought.code).as_posix(), path) for path in paths]
    return named, brought.place, brought.source


def _code_of(parts: Reference) -> Code:
    """The code of a controller that is found here; none for those that ship with this package."""
    if parts.is_file:
        path = Path(parts.place)
        if not path.is_file():  # whoever imports it says so
            return [], "", ""
        return [(path.name, path), *((other.name, other) for other in beside(path))], "", ""
    if parts.attribute:
        return [*_package(parts.place.partition(".")[0])], "", ""
    entry = plugins.discovered().get(parts.place)
    if entry is None:
        return [], "", ""
    return [*_package(entry.module.partition(".")[0])], entry.value, plugins.provenance(parts.place)


def beside(file: Path) -> list[Path]:
    """Weights and small data that lie beside a controller's file."""
    return [
        path
        for path in sorted(file.parent.iterdir())
        if path.suffix.lower() in BESIDE and path != file and path.is_file()
    ]


def _package(name: str) -> Iterator[tuple[str, Path]]:
    """The files of a top-level package or module, found without an import."""
    spec = None
    with suppress(ValueError):  # what runs as __main__ may have none
        spec = None if name in OWN else PathFinder.find_spec(name) or find_spec(name)
    if spec is None or spec.origin is None:
        return
    origin = Path(spec.origin)
    if not spec.submodule_search_locations:
        if spec.has_location:
            yield origin.name, origin
            yield from ((path.name, path) for path in beside(origin))
        return
    root = origin.parent
    for path in sorted(root.rglob("*")):
        parts = path.relative_to(root.parent).parts
        if path.is_file() and not any(p.startswith(".") or p == "__pycache__" for p in parts):
            yield "/".join(parts), path


def _options_here(parts: Reference) -> dict[str, Path]:
    """Options whose values are files or folders here; a number is one nowhere."""
    paths = {}
    for key, value in parts.options().items():
        path = Path(value).expanduser()
        with suppress(OSError, ValueError):  # as a name it is too long, or holds a NUL
            if value and not re.fullmatch(r"[-+0-9.e_]+|true|false", value) and path.exists():
                paths[key] = path.absolute()
    return paths

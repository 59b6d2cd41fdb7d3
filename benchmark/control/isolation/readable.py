"""Which files an isolated controller may read."""

import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

from benchmark.control import reference as naming
from benchmark.plumbing.files import cache_folder

SYSTEM = (
    "/usr/lib",
    "/usr/lib32",
    "/usr/lib64",
    "/usr/local/lib",
    "/usr/share/zoneinfo",
    "/lib",
    "/lib32",
    "/lib64",
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/proc/self",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/sys/devices/system/cpu",
    "/dev/zero",
    "/dev/urandom",
)
LIBRARIES = ("lib", "lib32", "lib64")  # of an installation of Python
INSTALLED = frozenset({"site-packages", "dist-packages"})
MODULES = frozenset({".py", ".pyc", ".so", ".zip", ".pth"})
METADATA = frozenset({".dist-info", ".egg-info", ".libs", ".data"})


def readable(reference: str) -> tuple[str, ...]:
    """Python, the packages it imports, the controller's own folder and files named as options.

    Never the cache, which holds the demand that is yet to come.
    """
    cache = cache_folder().resolve()
    prefixes = [Path(path) for path in (sys.prefix, sys.base_prefix)]
    libraries = [prefix / name for prefix in prefixes for name in LIBRARIES]
    imported = [part for path in sys.path for part in _importable(Path(path or ".").absolute())]
    given = [spelling for path in (*libraries, *imported) for spelling in (path, path.resolve())]
    paths = (path for root in (*given, *_named(reference)) for path in _around(cache, root))
    return (*SYSTEM, *dict.fromkeys(map(str, paths)))


def listed() -> tuple[str, ...]:
    """Folders on Python's path that are readable in part: to import, their entries are listed."""
    roots = [Path(path or ".").absolute() for path in sys.path]
    return tuple(dict.fromkeys(str(root) for root in roots if root.is_dir() and _is_mixed(root)))


def _importable(root: Path) -> Iterator[Path]:
    """What importing needs of a folder on Python's path: all of it where packages are installed.

    A clone or a working folder is on that path as well, with results and repositories in it.
    """
    if not root.is_dir() or not _is_mixed(root):
        yield root
        return
    for inner in sorted(root.iterdir()):
        is_package = (inner / "__init__.py").is_file()
        if is_package or inner.suffix in MODULES or inner.suffix in METADATA:
            yield inner


def _is_mixed(root: Path) -> bool:
    """Whether other things than modules may lie in it: it is neither Python's own nor installed."""
    standard = {Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib")}
    within = {root.resolve(), *root.resolve().parents}
    return root.name not in INSTALLED and not standard & within


def _named(reference: str) -> Iterator[Path]:
    parts = naming.parse(reference)
    if parts.is_file:
        yield Path(parts.place).resolve().parent
    for value in parts.options().values():
        yield Path(value).resolve()


def _around(cache: Path, root: Path) -> Iterator[Path]:
    """A root, or where the cache lies in it, what lies beside the cache and is not hidden."""
    if root == cache or cache in root.parents or not root.exists():
        return
    if root not in cache.parents:
        yield root
        return
    for inner in sorted(root.iterdir()):
        if not inner.name.startswith("."):
            yield from _around(cache, inner.resolve())

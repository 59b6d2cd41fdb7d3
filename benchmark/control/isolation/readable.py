"""Which files an isolated controller may read."""

import sys
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


def readable(reference: str) -> tuple[str, ...]:
    """Python and all it imports from, the controller's own folder and files named as options.

    Never the cache, which holds the demand that is yet to come.
    """
    cache = cache_folder().resolve()
    roots = [Path(path).resolve() for path in (*sys.path, sys.prefix, sys.base_prefix)]
    paths = (path for root in (*roots, *_named(reference)) for path in _around(cache, root))
    return (*SYSTEM, *dict.fromkeys(map(str, paths)))


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

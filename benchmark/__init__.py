"""Right of Way: a benchmark suite for mixed-traffic control at intersections."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("rightofway")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0+unknown"

"""Right of Way: a benchmark suite for mixed-traffic control at intersections.

``__init__.pyi`` lists the public names; each is imported when it is first used. Public packages
beside it: ``benchmark.learning``, ``benchmark.notebook``. Everything else may change any day.
"""

from importlib.metadata import PackageNotFoundError, version

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

try:
    __version__ = version("rightofway")
except PackageNotFoundError:  # a source tree that was never installed
    __version__ = "0+unknown"

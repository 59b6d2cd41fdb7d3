"""What a test leaves behind in its process is put back: no other test depends on it."""

import importlib
import os
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from benchmark.control import code, loading, plugins
from benchmark.control.isolation import remote

SIGNALS = (signal.SIGINT, signal.SIGTERM)
OTHERS = {"PYTEST_CURRENT_TEST", "SUMO_HOME"}
"""Variables that pytest and SUMO set for themselves."""

CACHES = (
    plugins._distribution,
    loading._distributions,
    remote.ask_declaration,
    code.of_package,
    code.of_module,
    code.of_code_and_weights,
    code.beside,
)
"""What is remembered of packages and files that may be gone."""

_lasting: set[str] = set()
"""Names of modules that were found to lie in no test's folder."""


@contextmanager
def put_back(temporary: Path) -> Iterator[None]:
    """Put back the path, modules, variables, the current folder and handlers of signals.

    Args:
        temporary: the folder of all tests' folders; a module from there is forgotten as soon as
            its folder is not on the path any more.
    """
    folder, path, variables = Path.cwd(), [*sys.path], _variables()
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        yield
    finally:
        os.chdir(folder)
        sys.path[:] = path
        _put_back_variables(variables)
        for number, handler in handlers.items():
            if handler is not None and signal.getsignal(number) is not handler:
                signal.signal(number, handler)
        _forget(f"{temporary}{os.sep}")
        plugins.discovered.cache_clear()


def _variables() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in OTHERS}


def _put_back_variables(before: Mapping[str, str]) -> None:
    now = _variables()
    if now != before:
        for name in now.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)


def _forget(temporary: str) -> None:
    """Forget what was imported, or looked for, in tests' folders that are not on the path."""
    gone = [name for name in sys.modules.keys() - _lasting if _is_gone(name, temporary)]
    for name in gone:
        del sys.modules[name]
    searched = [
        place
        for place in sys.path_importer_cache
        if place.startswith(temporary) and not _is_on_path(place)
    ]
    for place in searched:
        del sys.path_importer_cache[place]
    if gone or searched:
        importlib.invalidate_caches()
        for cached in CACHES:
            cached.cache_clear()


def _is_gone(name: str, temporary: str) -> bool:
    origin = _origin(sys.modules[name])
    if not origin.startswith(temporary):
        _lasting.add(name)
        return False
    return not _is_on_path(origin)


def _origin(module: ModuleType) -> str:
    """Where a module was imported from; nowhere, if no import statement finds it."""
    spec = getattr(module, "__spec__", None)
    return str((spec and spec.origin) or "")


def _is_on_path(place: str) -> bool:
    return any(place == folder or place.startswith(f"{folder}{os.sep}") for folder in sys.path)

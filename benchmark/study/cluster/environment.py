"""What must be the same wherever the episodes of a suite run, and where it is not.

Versions alone would not do, as an editable installation's code changes without them, so hashes of
code are compared too. Of a controller's requirements only versions are.
"""

import platform
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, requires, version

from benchmark.control import code, plugins, reference
from benchmark.records import provenance

Environment = dict[tuple[str, str], str]
"""Kind and name of a thing -> its version, hash or origin."""

OURS = "rightofway"
ALWAYS = (OURS, "eclipse-sumo", "libsumo", "sumolib", "numpy")
OFTEN = ("scipy", "torch")  # that others' controllers may compute with
MISSING = "missing"


def needed(controllers: Iterable[str]) -> Environment:
    """What this process has of all that determines records.

    Args:
        controllers: references of those that are to be run.
    """
    named = sorted({reference.parse(one).name for one in controllers})
    installed = [name for name in named if not reference.parse(name).is_file]
    wanted = [("Python", ""), ("platform", "")]
    wanted += [("version", name) for name in ALWAYS]
    wanted += [("code", name) for name in sorted({"benchmark", *map(_package, installed)})]
    wanted += [("controller", name) for name in installed]
    origins = {plugins.provenance(name).rpartition(" ")[0] for name in named}
    if others := origins - {OURS}:
        required = {name for other in others for name in _requirements(other)}
        used = {*required, *(name for name in OFTEN if _version(name) != MISSING)}
        wanted += [("version", name) for name in sorted(used - {*ALWAYS})]
    return {key: _look(key) for key in wanted}


def differences(wanted: Mapping[tuple[str, str], str]) -> list[str]:
    """What this process has otherwise than it should be, in words; empty if all is the same."""
    found = {key: _look(key) for key in wanted}
    return [
        f"{_title(key)} is {found[key]} there and {value} here"
        for key, value in wanted.items()
        if found[key] != value
    ]


def _title(key: tuple[str, str]) -> str:
    kind, name = key
    return {"code": f"the code of {name}", "controller": f'controller "{name}"'}.get(
        kind, name or kind
    )


@cache
def _look(key: tuple[str, str]) -> str:
    kind, name = key
    return LOOKS[kind](name)


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return MISSING


def _code(package: str) -> str:
    whole = code.of_benchmark() if package == "benchmark" else code.of_package(package)
    return whole[:12] or MISSING


def _controller(name: str) -> str:
    origin = plugins.provenance(name)
    return MISSING if origin == "unknown" else f"of {origin}"


LOOKS: dict[str, Callable[[str], str]] = {
    "Python": lambda _: platform.python_version(),
    "platform": lambda _: provenance.this_platform(),
    "version": _version,
    "code": _code,
    "controller": _controller,
}


def _package(controller: str) -> str:
    """The package that an installed controller, or one of a module, lies in."""
    parts = reference.parse(controller)
    module = parts.place if parts.attribute else plugins.discovered()[parts.place].module
    return module.partition(".")[0]


def _requirements(distribution: str) -> list[str]:
    """The names of what a distribution needs here, without its extras."""
    from packaging.requirements import Requirement

    try:
        lines = requires(distribution) or []
    except (PackageNotFoundError, ValueError):  # of what is not installed
        return []
    needs = map(Requirement, lines)
    return [one.name for one in needs if not one.marker or one.marker.evaluate({"extra": ""})]

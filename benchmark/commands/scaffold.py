"""Writes a new controller's package or a new scenario from templates.

The templates are a whole package and a whole scenario that work as they are, under names that
``NAMES`` replaces.
"""

import keyword
import re
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

from benchmark import __version__
from benchmark.control import plugins
from benchmark.plumbing import files
from benchmark.plumbing.errors import UsageError

TEMPLATES = Path(__file__).parent / "templates"
NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
SCENARIO_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
LONGEST = 60  # letters of a name


def controller(name: str, folder: Path) -> Path:
    """Write a package with a controller into a folder of its name.

    Args:
        name: of controller, distribution and folder.
        folder: where that folder is to be.

    Raises:
        UsageError: the name will not do, the folder is there, or it cannot be written.
    """
    module = name.replace("-", "_")
    _check(name, NAME, "my-controller")
    if name in plugins.discovered():
        raise UsageError(f'a controller "{name}" is installed already; choose another name')
    if keyword.iskeyword(module) or module in sys.stdlib_module_names or find_spec(module):
        raise UsageError(
            f'"{name}": its module {module} would hide one that is there; choose another name'
        )
    names = {
        "my-controller": name,
        "my_controller": module,
        "MyController": "".join(part.capitalize() for part in name.split("-")),
        "rightofway>=0.0.0": f"rightofway>={__version__}",
    }
    target = folder / name
    _write(TEMPLATES / "controller", target, names)
    return target


def scenario(name: str, folder: Path) -> Path:
    """Write a scenario into a file of its name.

    Args:
        name: with ``.toml`` or without.
        folder: where the file is to be.

    Raises:
        UsageError: as ``controller``.
    """
    name = name.removesuffix(".toml")
    _check(name, SCENARIO_NAME, "my-scenario")
    target = folder / f"{name}.toml"
    _write(TEMPLATES / "my-scenario.toml", target, {"my-scenario": name})
    return target


def _check(name: str, form: re.Pattern[str], example: str) -> None:
    if form.fullmatch(name) and len(name) <= LONGEST:
        return
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", name).lower()
    better = re.sub(r"[^a-z0-9]+", "-", words).strip("-")[:LONGEST].strip("-")
    hint = f'; did you mean "{better}"?' if form.fullmatch(better) else ""
    raise UsageError(
        f'"{name[:LONGEST]}" is no name: expected small letters, digits and hyphens, at most '
        f'{LONGEST}, as in "{example}"{hint}'
    )


def _write(template: Path, target: Path, names: Mapping[str, str]) -> None:
    """Copy a file or a folder under new names; all of it appears at once, or nothing."""
    if target.exists() or target.is_symlink():
        raise UsageError(f"{target} is there already, and is left as it is; choose another name")
    with files.writing(target, remedy=""), files.replaced(target) as draft:
        _copy(template, draft, names)


def _copy(template: Path, made: Path, names: Mapping[str, str]) -> None:
    if template.is_file():
        made.write_text(_renamed(template.read_text(encoding="utf-8"), names), encoding="utf-8")
        return
    made.mkdir()
    for inner in sorted(template.iterdir()):
        if inner.name != "__pycache__":  # installers compile what they install
            _copy(inner, made / _renamed(inner.name, names), names)


def _renamed(text: str, names: Mapping[str, str]) -> str:
    return re.sub("|".join(map(re.escape, names)), lambda found: names[found[0]], text)

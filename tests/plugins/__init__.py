"""Installs the test controllers beside this file without a network, as pip would lay them out."""

import shutil
import tomllib
from pathlib import Path

HERE = Path(__file__).parent


def install(target: Path, package: str = "hostile") -> Path:
    """Put a package of this folder into a folder for PYTHONPATH, with its entry points."""
    target.mkdir(parents=True, exist_ok=True)
    shutil.copy(HERE / package / f"{package}.py", target)
    return describe(HERE / package / "pyproject.toml", target)


def describe(file: Path, target: Path) -> Path:
    """Make what lies in a folder for PYTHONPATH a distribution, as its pyproject.toml says."""
    project = tomllib.loads(file.read_text())["project"]
    info = target / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir(parents=True)
    head = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    people = [f"Author-email: {p['name']} <{p['email']}>\n" for p in project.get("authors", [])]
    licence = [f"License-Expression: {project['license']}\n"] if "license" in project else []
    (info / "METADATA").write_text("".join([head, *people, *licence]))
    lines = [
        line
        for group, entries in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{name} = {value}" for name, value in entries.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines))
    return target

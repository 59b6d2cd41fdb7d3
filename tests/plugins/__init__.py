"""Installs the test controllers beside this file without a network, as pip would lay them out."""

import shutil
import tomllib
from pathlib import Path

HERE = Path(__file__).parent


def install(target: Path, package: str = "hostile") -> Path:
    """Put a package into a folder for PYTHONPATH, with its entry points."""
    source = HERE / package
    project = tomllib.loads((source / "pyproject.toml").read_text())["project"]
    info = target / f"{project['name']}-{project['version']}.dist-info"
    info.mkdir(parents=True)
    shutil.copy(source / f"{package}.py", target)
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

"""Installs the test controllers beside this file without a network, as pip would lay them out."""

import shutil
import tomllib
from pathlib import Path

HERE = Path(__file__).parent


def install(target: Path, package: str = "hostile") -> Path:
    """Put a package of this folder into a folder for PYTHONPATH, with its entry points."""
    project = tomllib.loads((HERE / package / "pyproject.toml").read_text())["project"]
    info = target / f"{project['name']}-{project['version']}.dist-info"
    info.mkdir(parents=True)
    shutil.copy(HERE / package / f"{package}.py", target)
    head = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (info / "METADATA").write_text(head)
    lines = [
        line
        for group, entries in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{name} = {value}" for name, value in entries.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines))
    return target

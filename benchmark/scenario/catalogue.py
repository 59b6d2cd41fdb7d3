"""Where scenarios are: the shipped ones by name, anyone's by path."""

from collections.abc import Iterable
from pathlib import Path

from benchmark.plumbing.errors import ScenarioError
from benchmark.plumbing.files import paths_below
from benchmark.plumbing.messages import nearest
from benchmark.scenario.scenario import Scenario, load_scenario

LONGEST_NAME = 255  # of a file or folder
LARGEST_DEMAND = 100_000  # veh/h behind an @


def shipped_folder() -> Path:
    """The shipped scenarios: in the wheel beside this file, in a source tree at its top."""
    inside = Path(__file__).parents[1] / "scenarios"
    return inside if inside.is_dir() else Path(__file__).parents[2] / "scenarios"


def shipped_scenarios() -> dict[str, Path]:
    """The shipped scenario files by name, as in ``colorado-springs/229``."""
    paths = paths_below(shipped_folder(), ".toml", ScenarioError)
    return {f"{path.parent.name}/{path.stem}": path for path in paths}


def find_scenarios(references: Iterable[str], also: Iterable[str] = ()) -> list[Scenario]:
    """Load scenarios by reference, each once, in the order asked for.

    Args:
        references: each a file, a folder of files, a shipped name (``colorado-springs/229`` or
            just ``229``) or a shipped folder's name (``colorado-springs``); any of these with
            ``@700`` behind it has its turning counts scaled to 700 veh/h in total.
        also: names that the caller knows besides, for suggestions.

    Raises:
        ScenarioError: a reference leads nowhere, or a file is not a valid scenario.
    """
    others = tuple(also)
    paths: dict[tuple[Path, float | None], Path] = {}
    for reference in references:
        place, demand = _split(reference)
        for path in _resolve(place, others):
            paths.setdefault((path.resolve(), demand), path)
    return [
        load_scenario(path) if demand is None else load_scenario(path).at_demand(demand)
        for (_, demand), path in paths.items()
    ]


def find_scenario(reference: str) -> Scenario:
    """The only scenario that a reference leads to.

    Raises:
        ScenarioError: as ``find_scenarios``, or it leads to several.
    """
    scenarios = find_scenarios([reference])
    if len(scenarios) != 1:
        names = ", ".join(scenario.name for scenario in scenarios)
        raise ScenarioError(f'"{reference}" names {len(scenarios)} scenarios ({names}); choose one')
    return scenarios[0]


def reference_of(scenario: Scenario) -> str:
    """What leads ``find_scenarios`` to a scenario that it has found before, in the same folder."""
    if scenario.path is None:
        return scenario.name
    name = f"{scenario.path.resolve().parent.name}/{scenario.path.stem}"
    demand = scenario.name.removeprefix(name)  # as in @700
    place = name if shipped_scenarios().get(name) == scenario.path else str(scenario.path)
    return place + demand


def _split(reference: str) -> tuple[str, float | None]:
    """A reference and the total demand behind its @ [veh/h], if it has one."""
    place, at, total = reference.rpartition("@")
    if not at or Path(reference).exists():
        return reference, None
    try:
        demand = float(total)
    except ValueError:
        demand = 0.0
    if not 0 < demand <= LARGEST_DEMAND:
        raise ScenarioError(
            f'scenario "{reference}": expected vehicles per hour behind the @, as in "{place}@700"'
        )
    return place, demand


def _resolve(reference: str, also: Iterable[str]) -> list[Path]:
    path, known = Path(reference), shipped_scenarios()
    if any(len(part) > LONGEST_NAME for part in path.parts):
        raise ScenarioError(f'unknown scenario "{reference[:40]}...": no file has such a long name')
    if path.is_file() or path.suffix == ".toml":
        return [path]  # a missing file is reported where it is read
    if path.is_dir() and (files := paths_below(path, ".toml", ScenarioError)):
        return files
    if found := [file for name, file in known.items() if reference in (name, *name.split("/"))]:
        return found
    if path.is_dir():
        raise ScenarioError(f"{reference}: no scenario files (*.toml) in this folder")
    folders = {name.split("/")[0] for name in known}
    raise ScenarioError(
        f'unknown scenario "{reference}": neither a file, a folder nor shipped'
        f"{nearest(reference, [*known, *sorted(folders), *also])}"
    )

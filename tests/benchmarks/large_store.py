"""What a folder of very many records costs: ``make large-store``.

Makes records from the committed ones, of 6 controllers on as many maps as it takes, each at ten
rates with 40 seeds, and runs the commands that read whole folders, in processes of their own.
docs/scaling.md keeps what it said.
"""

import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Iterator
from pathlib import Path
from typing import Any

COMMAND = Path(sys.executable).parent / "rightofway"
RESULTS = Path(__file__).parents[2] / "results" / "records"
CONTROLLERS = ("traffic-light", "virtual-signal", "wang", "wang-tuned", "time-windows")
CONTROLLERS += ("hierarchical-tuned",)
SEEDS = 40
SPREAD = 0.1  # of each figure around a committed one, as the deviation of its logarithm
WALL, MEMORY = 20.0, 2.0  # s, GB


def main() -> None:
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=1_000_000)
    parser.add_argument("--folder", type=Path, help="where there is room; default: temporary")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as place:
        folder = Path(place)
        count = fill(folder / "records", options.records)
        say(f"{count} records, {size(folder):.2f} GB as JSON Lines")
        measure("leaderboard from JSON Lines", "leaderboard", folder)
        measure("compact", "compact", folder)
        say(f"{size(folder):.2f} GB packed")
        for name in ("leaderboard", "figures"):
            wall, memory = measure(f"{name} from Parquet", name, folder)
            if wall > WALL or memory > MEMORY:
                say(f"  past {WALL:g} s or {MEMORY:g} GB")
        with (folder / "records" / "city-0.jsonl").open("w") as file:
            file.writelines(lines(0))
        measure("leaderboard of both, mixed", "leaderboard", folder)


def fill(folder: Path, wanted: int) -> int:
    """Write records, a file for each map; how many."""
    folder.mkdir()
    count = number = 0
    while count < wanted:
        made = [*lines(number)]
        (folder / f"city-{number}.jsonl").write_text("".join(made))
        count, number = count + len(made), number + 1
    return count


def lines(number: int) -> Iterator[str]:
    """The records of one map, like those of a committed intersection but for chance.

    Every figure is drawn anew, since equal ones would be packed and estimated for nothing.
    """
    chance = random.Random(number)
    for record in BASES[number % len(BASES)]:
        for more in range(0, SEEDS, 20):
            changed = {
                "scenario": f"city/{number}",
                "scenario_hash": f"{number:064x}",
                "network_hash": f"{number + 1:064x}",
                "seed": record["seed"] + more,
                "routes_hash": f"{1000 * number + record['seed'] + more:064x}",
                "identity": f"{chance.getrandbits(256):064x}",
                **{key: varied(record[key], chance) for key in ("junctions", "trips", "wall_time")},
            }
            yield json.dumps(record | changed, separators=(",", ":")) + "\n"


def varied(value: Any, chance: random.Random) -> Any:
    """A value of a record with each number in it drawn anew around what it was."""
    match value:
        case dict():
            return {key: varied(one, chance) for key, one in value.items()}
        case list():
            return [varied(one, chance) for one in value]
        case int():
            return round(value * chance.lognormvariate(0, SPREAD))
        case float():  # with as many digits, as they take room
            digits = len(str(value).partition(".")[2])
            return round(value * chance.lognormvariate(0, SPREAD), digits)
    return value


def bases() -> list[list[dict[str, Any]]]:
    """The records of each committed intersection."""
    every = [map(json.loads, path.read_text().splitlines()) for path in sorted(RESULTS.iterdir())]
    return [[one for one in records if one["controller"] in CONTROLLERS] for records in every]


BASES = bases()


def measure(title: str, command: str, folder: Path) -> tuple[float, float]:
    """Run a command on a folder: wall time [s] and peak memory [GB]."""
    out = ["--out", folder / "figures"] if command == "figures" else []
    began = time.monotonic()
    process = subprocess.Popen(
        [COMMAND, command, "--records", folder, *out], stdout=subprocess.DEVNULL
    )
    _, status, used = os.wait4(process.pid, 0)
    wall, memory = time.monotonic() - began, used.ru_maxrss / 1e6
    say(f"{title}: {wall:.1f} s, {memory:.2f} GB" + (" FAILED" if status else ""))
    shutil.rmtree(folder / "figures", ignore_errors=True)
    return wall, memory


def size(folder: Path) -> float:
    return sum(one.stat().st_size for one in folder.rglob("*") if one.is_file()) / 1e9


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
